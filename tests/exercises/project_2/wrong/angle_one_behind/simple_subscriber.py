import math
import rclpy
from rclpy.node import Node
from std_msgs.msg import Float64


class Listener(Node):
    def __init__(self):
        super().__init__('listener')
        self.angle = 0.0
        self.create_subscription(Float64, '/joint_commands', self.on_angle, 10)

    def on_angle(self, msg):
        self.get_logger().info(f'{self.angle:.3f} rad, {math.degrees(self.angle):.2f} deg')
        self.angle = msg.data


def main():
    rclpy.init()
    rclpy.spin(Listener())


if __name__ == '__main__':
    main()
