import numpy as np
import rclpy
from rclpy.node import Node
from sensor_msgs.msg import Temperature
from std_msgs.msg import Int32


class TemperatureSensor(Node):
    def __init__(self):
        super().__init__('temperature_sensor')
        self.rng = np.random.default_rng()
        self.pub = self.create_publisher(Temperature, '/temperature', 10)
        self.create_subscription(Int32, '/fan_speed', self.fan, 10)
        self.create_timer(0.2, self.measure)

    def measure(self):
        msg = Temperature()
        msg.header.stamp = self.get_clock().now().to_msg()
        msg.header.frame_id = 'sensor'
        msg.temperature = float(self.rng.uniform(20.0, 30.0))
        msg.variance = 0.25
        self.pub.publish(msg)

    def fan(self, msg):
        self.get_logger().info(f'Received: {msg}')


def main():
    rclpy.init()
    rclpy.spin(TemperatureSensor())


if __name__ == '__main__':
    main()
