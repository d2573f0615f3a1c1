import math
import rclpy
from rclpy.node import Node
from std_msgs.msg import Float64


class Limited(Node):
    """Keeps each angle within a quarter turn before it is logged."""

    def __init__(self):
        super().__init__('limited')
        self.create_subscription(Float64, '/joint_commands', self.log, 10)

    def log(self, msg):
        angle = max(-math.pi / 2, min(math.pi / 2, msg.data))
        self.get_logger().info(f'angle={angle:.4f} rad angle={math.degrees(angle):.1f} deg')


rclpy.init()
rclpy.spin(Limited())
