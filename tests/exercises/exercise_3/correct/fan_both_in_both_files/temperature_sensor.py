import random
import rclpy
from rclpy.node import Node
from std_msgs.msg import Float32, Int32


class TemperatureSensor(Node):
    def __init__(self):
        super().__init__('temperature_sensor')
        self.pub = self.create_publisher(Float32, '/temperature', 10)
        self.sub = self.create_subscription(Int32, '/fan_speed', self.fan_callback, 10)
        self.timer = self.create_timer(0.2, self.timer_callback)

    def timer_callback(self):
        msg = Float32()
        msg.data = random.uniform(20.0, 30.0)
        self.pub.publish(msg)

    def fan_callback(self, msg):
        self.get_logger().info(f'Fan speed: {msg.data}')


class FanController(Node):
    def __init__(self):
        super().__init__('fan_controller')
        self.pub = self.create_publisher(Int32, '/fan_speed', 10)
        self.sub = self.create_subscription(Float32, '/temperature', self.temp_callback, 10)

    def temp_callback(self, msg):
        self.pub.publish(Int32(data=100 if msg.data > 25.0 else 0))


def main():
    rclpy.init()
    rclpy.spin(TemperatureSensor())


if __name__ == '__main__':
    main()
