import random
import rclpy
from rclpy.node import Node
from std_msgs.msg import Float32, UInt8


class TemperatureSensor(Node):
    def __init__(self):
        super().__init__('temperature_sensor')
        low = self.declare_parameter('low', 20).value
        high = self.declare_parameter('high', 30).value
        self.range = (low, high)
        self.last = None
        self.pub = self.create_publisher(UInt8, '/temperature', 10)
        self.create_subscription(Float32, '/fan_speed', self.fan_callback, 10)
        self.create_timer(1.0 / self.declare_parameter('rate', 5.0).value, self.callback)

    def callback(self):
        msg = UInt8()
        msg.data = random.randint(*self.range)
        self.pub.publish(msg)

    def fan_callback(self, msg):
        if msg.data != self.last:
            self.get_logger().info(f'Fan speed changed: {self.last} -> {msg.data}')
            self.last = msg.data


def main():
    rclpy.init()
    rclpy.spin(TemperatureSensor())


if __name__ == '__main__':
    main()
