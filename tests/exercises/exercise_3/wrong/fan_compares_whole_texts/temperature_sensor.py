import random
import rclpy
from rclpy.node import Node
from std_msgs.msg import Float32


class TemperatureSensor(Node):
    def __init__(self):
        super().__init__('temperature_sensor')
        self.publisher = self.create_publisher(Float32, '/temperature', 10)
        self.subscription = self.create_subscription(Float32, '/fan_speed', self.fan_callback, 10)
        self.timer = self.create_timer(0.2, self.timer_callback)

    def timer_callback(self):
        msg = Float32()
        msg.data = random.uniform(20.0, 30.0)
        self.publisher.publish(msg)

    def fan_callback(self, msg):
        self.get_logger().info(f'Fan speed: {msg.data}')


def main(args=None):
    rclpy.init(args=args)
    rclpy.spin(TemperatureSensor())


if __name__ == '__main__':
    main()
