import random
import rclpy
from rclpy.node import Node
from my_robot_interfaces.msg import RoomTemperature
from std_msgs.msg import Int32


class TemperatureSensor(Node):
    def __init__(self):
        super().__init__('temperature_sensor')
        self.pub = self.create_publisher(RoomTemperature, '/temperature', 10)
        self.create_subscription(Int32, '/fan_speed', self.fan, 10)
        self.create_timer(0.2, self.tick)

    def tick(self):
        msg = RoomTemperature()
        msg.celsius = random.uniform(20.0, 30.0)
        self.pub.publish(msg)

    def fan(self, msg):
        self.get_logger().info(f'{msg.data}')


def main(args=None):
    rclpy.init(args=args)
    rclpy.spin(TemperatureSensor())


if __name__ == '__main__':
    main()
