import math
import rclpy
from rclpy.node import Node
from std_msgs.msg import Float64


class Labels(Node):
    """Words before the numbers, a degree sign, and no decimals where they are zero."""

    def __init__(self):
        super().__init__('labels')
        self.create_subscription(Float64, '/joint_commands', self.log, 10)

    def log(self, msg):
        self.get_logger().info(f'rad {msg.data:g}, deg {math.degrees(msg.data):g}\u00b0')


def main():
    rclpy.init()
    rclpy.spin(Labels())


if __name__ == '__main__':
    main()
