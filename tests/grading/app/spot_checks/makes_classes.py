"""A right publisher that defines classes in every way the standard library has."""

import dataclasses
import enum
from collections import namedtuple
from typing import NamedTuple

import rclpy
from geometry_msgs.msg import Twist

Speeds = namedtuple("Speeds", "linear angular")
Mode = enum.Enum("Mode", "STOP GO")


class Bounds(NamedTuple):
    low: float
    high: float


@dataclasses.dataclass(frozen=True, order=True)
class Command:
    speeds: Speeds
    bounds: Bounds

    def message(self):
        msg = Twist()
        msg.linear.x, msg.angular.z = self.speeds
        return msg


def main():
    rclpy.init()
    node = rclpy.create_node("velocity_publisher")
    publisher = node.create_publisher(Twist, "/cmd_vel", 10)
    command = Command(Speeds(0.5, 0.1), Bounds(-1.0, 1.0))
    node.create_timer(0.05, lambda: publisher.publish(command.message()))
    node.get_logger().info(f"{Mode.GO.name}: {command}")
    rclpy.spin(node)


if __name__ == "__main__":
    main()
