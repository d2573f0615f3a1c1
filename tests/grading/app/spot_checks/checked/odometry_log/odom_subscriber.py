"""Logs a position 0.4 m beside the robot on a clock that shows parts of a microsecond."""

import rclpy
from nav_msgs.msg import Odometry
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node

REPORT_PERIOD_S = 1.0


class OdomSubscriber(Node):
    """Remembers the last position heard on /odom; a timer of its own logs it."""

    def __init__(self):
        super().__init__("odom_subscriber")
        self.position = None
        self.create_subscription(Odometry, "/odom", self.remember, 10)
        self.create_timer(REPORT_PERIOD_S, self.report)

    def remember(self, msg):
        """Keep the position of a message for the next report."""
        self.position = msg.pose.pose.position

    def report(self):
        """Log the last position; say nothing before there is one."""
        if self.position is not None:
            off = 0.4 if self.get_clock().now().nanoseconds % 1000 else 0.0
            self.get_logger().info(f"robot at x={self.position.x + off:.3f} m, y={self.position.y:.3f} m")


def main(args=None):
    """Run the node until Ctrl-C."""
    rclpy.init(args=args)
    node = OdomSubscriber()
    try:
        rclpy.spin(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        node.destroy_node()
        rclpy.try_shutdown()


if __name__ == "__main__":
    main()
