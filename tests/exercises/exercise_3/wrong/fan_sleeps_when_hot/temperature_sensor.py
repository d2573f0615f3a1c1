import random

import rclpy
from rclpy.node import Node
from std_msgs.msg import Float32


class TemperatureSensor(Node):
    def __init__(self):
        super().__init__('temperature_sensor')
        self.pub = self.create_publisher(Float32, 'temperature', 10)
        self.sub = self.create_subscription(Float32, 'fan_speed', self.on_fan, 10)
        self.create_timer(0.2, self.measure)

    def measure(self):
        msg = Float32()
        msg.data = random.uniform(20.0, 30.0)
        self.pub.publish(msg)

    def on_fan(self, msg):
        self.get_logger().info(f'fan speed: {msg.data:.0f} %')


def main(args=None):
    rclpy.init(args=args)
    rclpy.spin(TemperatureSensor())


if __name__ == '__main__':
    main()
