import math
import rclpy
from rclpy.node import Node
from std_msgs.msg import Float64


class Turn(Node):
    """Degrees from 0 to 360."""

    def __init__(self):
        super().__init__('turn')
        self.create_subscription(Float64, '/joint_commands', self.log, 10)

    def log(self, msg):
        self.get_logger().info(f'{msg.data:.3f} rad = {math.degrees(msg.data) % 360:.1f} degrees')


def main():
    rclpy.init()
    rclpy.spin(Turn())


main()
