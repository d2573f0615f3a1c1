import os
import threading

import rclpy
from rclpy.node import Node
from std_msgs.msg import Float32


class Sensor:
    def __init__(self, node):
        self.node = node
        self.pub = node.create_publisher(Float32, 'temperature', 10)
        node.create_subscription(Float32, 'fan_speed', self.fan, 10)
        self.finished = threading.Event()
        self.thread = threading.Thread(target=self.work, name='sensor')

    def fan(self, msg):
        self.node.get_logger().info(f'fan {msg.data}')

    def work(self):
        while not self.finished.is_set():
            raw = int.from_bytes(os.urandom(2), 'little')
            self.pub.publish(Float32(data=20.0 + raw / 65535 * 10.0))
            self.finished.wait(timeout=0.2)


def main():
    rclpy.init()
    sensor = Sensor(Node('temperature_sensor'))
    sensor.thread.start()
    try:
        rclpy.spin(sensor.node)
    except BaseException:
        pass
    finally:
        sensor.finished.set()
        sensor.thread.join()


if __name__ == '__main__':
    main()
