"""Lies in a package, has a relative import and no __main__ guard, and logs."""

import rclpy
from geometry_msgs.msg import Twist
from rclpy.node import Node

from .speeds import FORWARD, TURN


class VelocityPublisher(Node):
    def __init__(self):
        super().__init__("velocity_publisher")
        self.publisher = self.create_publisher(Twist, "/cmd_vel", 10)
        self.create_timer(0.05, self.tick)
        self.get_logger().info("driving")

    def tick(self):
        message = Twist()
        message.linear.x = FORWARD
        message.angular.z = TURN
        self.publisher.publish(message)


def main():
    rclpy.init()
    rclpy.spin(VelocityPublisher())
