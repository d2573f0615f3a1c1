import random
import rclpy
from rclpy.node import Node
from std_msgs.msg import Float32


class TemperatureSensor(Node):
    def __init__(self):
        super().__init__('temperature_sensor')
        self.fan_speed = None
        self.pub = self.create_publisher(Float32, '/temperature', 10)
        self.create_subscription(Float32, '/fan_speed', self.on_fan, 10)
        self.create_timer(0.2, self.on_temperature)
        self.create_timer(1.0, self.on_report)

    def on_temperature(self):
        self.temperature = random.uniform(20.0, 30.0)
        self.pub.publish(Float32(data=self.temperature))

    def on_fan(self, msg):
        self.fan_speed = msg.data

    def on_report(self):
        if self.fan_speed is not None:
            self.get_logger().info(f'temperature {self.temperature:.1f}, fan speed {self.fan_speed:.0f}')


def main():
    rclpy.init()
    rclpy.spin(TemperatureSensor())


if __name__ == '__main__':
    main()
