"""Simulated thermometer with measurement noise."""
import random
import rclpy
from rclpy.node import Node
from sensor_msgs.msg import Temperature
from std_msgs.msg import UInt8


class Thermometer(Node):
    def __init__(self):
        super().__init__('thermometer')
        self.pub = self.create_publisher(Temperature, '/temperature', 10)
        self.create_subscription(UInt8, '/fan_speed', self.on_fan_speed, 10)
        self.create_timer(0.2, self.on_timer)

    def on_timer(self):
        msg = Temperature()
        msg.header.stamp = self.get_clock().now().to_msg()
        msg.header.frame_id = 'room'
        msg.temperature = min(30.0, max(20.0, random.gauss(25.0, 2.0)))
        msg.variance = 4.0
        self.pub.publish(msg)

    def on_fan_speed(self, msg):
        self.get_logger().info('received fan_speed={}'.format(msg.data))


def main():
    rclpy.init()
    node = Thermometer()
    try:
        rclpy.spin(node)
    except KeyboardInterrupt:
        pass
    finally:
        node.destroy_node()
        rclpy.try_shutdown()


if __name__ == '__main__':
    main()
