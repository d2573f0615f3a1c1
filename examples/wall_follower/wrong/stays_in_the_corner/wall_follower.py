"""Follows the wall on its left at half a metre, by the nearest thing that the laser scanner sees there."""

import math

import rclpy
from geometry_msgs.msg import Twist
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from sensor_msgs.msg import LaserScan

SPEED = 0.25
DISTANCE = 0.5
MOST_TURN = 1.2


class WallFollower(Node):
    """Answers each scan with a command."""

    def __init__(self):
        super().__init__("wall_follower")
        self.state = "wall"
        self.commands = self.create_publisher(Twist, "/cmd_vel", 10)
        self.create_subscription(LaserScan, "/scan", self.on_scan, 10)

    def on_scan(self, scan):
        """Turn until the nearest thing is straight to the left, and at the right distance."""
        distance, angle = nearest(scan)
        turn = 1.5 * (angle - math.pi / 2) + 2.0 * (distance - DISTANCE)
        if self.state == "wall" and abs(angle) < 0.5 and distance < 0.6:
            self.state = "corner"
        if self.state == "corner":
            turn = -MOST_TURN
        turn = max(-MOST_TURN, min(MOST_TURN, turn))
        command = Twist()
        command.linear.x = SPEED * (1 - abs(turn) / (2 * MOST_TURN))
        command.angular.z = turn
        self.commands.publish(command)


def nearest(scan):
    """Return the smallest valid range from ahead on the right to behind on the left, and its angle."""
    found = []
    for number, distance in enumerate(scan.ranges):
        angle = scan.angle_min + number * scan.angle_increment
        if -math.pi / 3 <= angle and scan.range_min <= distance <= scan.range_max:
            found.append((distance, angle))
    return min(found, default=(DISTANCE, math.pi / 2))


def main():
    rclpy.init()
    node = WallFollower()
    try:
        rclpy.spin(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        node.destroy_node()
        rclpy.try_shutdown()


if __name__ == "__main__":
    main()
