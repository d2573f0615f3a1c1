import math
import rclpy
from rclpy.node import Node
from std_msgs.msg import Float64


class Angles(Node):
    """An async callback; tells the angle before as well, and the step between them."""

    def __init__(self):
        super().__init__('angles')
        self.before = 0.0
        self.create_subscription(Float64, '/joint_commands', self.heard, 10)

    async def heard(self, msg):
        now, last = msg.data, self.before
        self.get_logger().info(f'rad: {now:.2f} (was {last:.2f}, step {now - last:+.2f})')
        self.get_logger().info(f'deg: {math.degrees(now):.1f} (was {math.degrees(last):.1f})')
        self.before = now


def main():
    rclpy.init()
    node = Angles()
    while rclpy.ok():
        rclpy.spin_once(node, timeout_sec=0.2)


if __name__ == '__main__':
    main()
