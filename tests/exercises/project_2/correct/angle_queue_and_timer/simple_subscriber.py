import collections
import math

import rclpy
from rclpy.node import Node
from std_msgs.msg import Float64


class Buffered(Node):
    """The callback only remembers; a fast timer logs what has come."""

    def __init__(self):
        super().__init__("buffered")
        self.todo = collections.deque()
        self.create_subscription(Float64, "/joint_commands", lambda msg: self.todo.append(msg), 10)
        self.create_timer(0.05, self.flush)

    def flush(self):
        while self.todo:
            angle = self.todo.popleft().data
            self.get_logger().info(f"angle_rad={angle:.2f} angle_deg={math.degrees(angle):.0f}")


def main():
    rclpy.init()
    node = Buffered()
    try:
        rclpy.spin(node)
    finally:
        node.destroy_node()
        rclpy.try_shutdown()


if __name__ == "__main__":
    main()
