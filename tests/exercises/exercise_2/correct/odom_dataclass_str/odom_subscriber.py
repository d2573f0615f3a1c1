import math
from dataclasses import dataclass
from typing import Optional

import rclpy
from rclpy.node import Node
from nav_msgs.msg import Odometry


@dataclass
class Pose2D:
    x: float = 0.0
    y: float = 0.0
    theta: float = 0.0

    @classmethod
    def from_msg(cls, msg: Odometry) -> 'Pose2D':
        q = msg.pose.pose.orientation
        yaw = math.atan2(2 * (q.w * q.z + q.x * q.y), 1 - 2 * (q.y * q.y + q.z * q.z))
        return cls(msg.pose.pose.position.x, msg.pose.pose.position.y, yaw)

    def __str__(self) -> str:
        return f'at ({self.x:6.2f} | {self.y:6.2f}), heading {math.degrees(self.theta):.0f}°'


class OdomSubscriber(Node):
    pose: Optional[Pose2D] = None

    def __init__(self) -> None:
        super().__init__('odom_subscriber')
        self.create_subscription(Odometry, '/odom', self.on_odom, 10)
        self.create_timer(1, self.report)

    def on_odom(self, msg: Odometry) -> None:
        self.pose = Pose2D.from_msg(msg)

    def report(self) -> None:
        if self.pose:
            self.get_logger().info(f'{self.pose!s}')


def main() -> None:
    rclpy.init()
    try:
        rclpy.spin(OdomSubscriber())
    except KeyboardInterrupt:
        ...


if __name__ == '__main__':
    main()
