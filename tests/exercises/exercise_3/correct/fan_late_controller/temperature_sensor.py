import random
import rclpy
from rclpy.node import Node
from std_msgs.msg import Float32


class TemperatureSensor(Node):
    def __init__(self):
        super().__init__('temperature_sensor')
        self.pub = self.create_publisher(Float32, '/temperature', 10)
        self.sub = self.create_subscription(Float32, '/fan_speed', self.log_speed, 10)
        self.timer = self.create_timer(0.2, self.send)

    def send(self):
        if self.pub.get_subscription_count() == 0:
            self.get_logger().info('nobody listens', throttle_duration_sec=1.0)
            return
        self.pub.publish(Float32(data=random.uniform(20.0, 30.0)))

    def log_speed(self, msg):
        self.get_logger().info(f'{msg.data}')


def main():
    rclpy.init()
    rclpy.spin(TemperatureSensor())


if __name__ == '__main__':
    main()
