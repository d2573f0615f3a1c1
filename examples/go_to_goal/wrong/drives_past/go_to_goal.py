"""Drives a robot to each goal on /goal, with a controller that is proportional to distance and direction."""

import math

import rclpy
from geometry_msgs.msg import Point, Twist
from nav_msgs.msg import Odometry
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node

MAX_SPEED = 0.5
MAX_TURN_RATE = 1.5
ARRIVED = 0.05


def limited(value, most):
    """Return the nearest value within [-most, most]."""
    return max(-most, min(most, value))


class GoToGoal(Node):
    """Follows the latest goal."""

    def __init__(self):
        super().__init__("go_to_goal")
        self.goal = None
        self.commands = self.create_publisher(Twist, "/cmd_vel", 10)
        self.create_subscription(Point, "/goal", self.on_goal, 10)
        self.create_subscription(Odometry, "/odom", self.on_odometry, 10)

    def on_goal(self, goal):
        """Keep the goal."""
        self.goal = goal

    def on_odometry(self, odometry):
        """Command the speeds that bring the robot nearer to the goal."""
        if self.goal is None:
            return
        place, turned = odometry.pose.pose.position, odometry.pose.pose.orientation
        heading = 2.0 * math.atan2(turned.z, turned.w)
        dx, dy = self.goal.x - place.x, self.goal.y - place.y
        command = Twist()
        if math.hypot(dx, dy) < ARRIVED:
            self.goal = None
            return
        error = math.remainder(math.atan2(dy, dx) - heading, math.tau)
        command.angular.z = limited(2.0 * error, MAX_TURN_RATE)
        command.linear.x = limited(math.hypot(dx, dy), MAX_SPEED) * max(0.0, math.cos(error))
        self.commands.publish(command)


def main():
    rclpy.init()
    node = GoToGoal()
    try:
        rclpy.spin(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        node.destroy_node()
        rclpy.try_shutdown()


if __name__ == "__main__":
    main()
