import random
import threading
import time
import rclpy
from rclpy.node import Node
from std_msgs.msg import Float32


class Sensor(Node):
    def __init__(self):
        super().__init__('sensor')
        self.pub = self.create_publisher(Float32, '/temperature', 10)
        self.create_subscription(Float32, '/fan_speed', self.fan, 10)
        self.worker = threading.Thread(target=self.measure, daemon=True)
        self.worker.start()

    def measure(self):
        while rclpy.ok():
            self.pub.publish(Float32(data=random.uniform(20.0, 30.0)))
            time.sleep(0.2)

    def fan(self, msg):
        self.get_logger().info('fan: %g' % msg.data)


def main():
    rclpy.init()
    rclpy.spin(Sensor())


if __name__ == '__main__':
    main()
