from typing import NamedTuple, Optional

import rclpy
from rclpy.node import Node
from nav_msgs.msg import Odometry


class Position2D(NamedTuple):
    x: float
    y: float


class OdomSubscriber(Node):
    def __init__(self) -> None:
        super().__init__('odom_subscriber')
        self.current: Optional[Position2D] = None
        self.create_subscription(Odometry, '/odom', self._on_odom, 10)
        self.create_timer(1.0, self._log)

    def _on_odom(self, msg: Odometry) -> None:
        self.current = Position2D(msg.pose.pose.position.x, msg.pose.pose.position.y)

    def _log(self) -> None:
        if self.current:
            self.get_logger().info(repr(self.current))


def main() -> None:
    rclpy.init()
    rclpy.spin(OdomSubscriber())


if __name__ == '__main__':
    main()
