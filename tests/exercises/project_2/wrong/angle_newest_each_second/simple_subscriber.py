import math
import rclpy
from rclpy.node import Node
from std_msgs.msg import Float64


class Newest(Node):
    """Logs the newest angle once a second."""

    def __init__(self):
        super().__init__('newest')
        self.angle = None
        self.create_subscription(Float64, '/joint_commands', self.keep, 10)
        self.create_timer(1.0, self.log)

    def keep(self, msg):
        self.angle = msg.data

    def log(self):
        if self.angle is not None:
            self.get_logger().info(f'{self.angle:.3f} rad = {math.degrees(self.angle):.1f} degrees')


def main():
    rclpy.init()
    rclpy.spin(Newest())


main()
