import random

import rclpy
from rclpy.node import Node
from std_msgs.msg import Float32


class TemperatureSensor(Node):
    def __init__(self):
        super().__init__('temperature_sensor')
        self.low = self.declare_parameter('min_temp', 20.0).value
        self.high = self.declare_parameter('max_temp', 30.0).get_parameter_value().double_value
        rate = self.declare_parameter('rate_hz', 5).value
        self.pub = self.create_publisher(Float32, self.declare_parameter('topic', 'temperature').value, 10)
        self.create_subscription(Float32, 'fan_speed', self.fan, 10)
        self.create_timer(1 / rate, self.publish)

    def publish(self):
        value = random.triangular(self.low, self.high)
        self.get_logger().info('Temperature: %.1f °C' % value)
        self.pub.publish(Float32(data=value))

    def fan(self, msg):
        self.get_logger().info('Fan speed: %.1f %%' % msg.data)


def main(args=None):
    rclpy.init(args=args)
    node = TemperatureSensor()
    try:
        rclpy.spin(node)
    finally:
        node.destroy_node()


if __name__ == '__main__':
    main()
