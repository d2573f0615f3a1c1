"""Ends by an exception that nobody catches, right after a last command."""

import rclpy
from geometry_msgs.msg import Twist
from rclpy.node import Node


def command():
    message = Twist()
    message.linear.x = 0.5
    message.angular.z = 0.1
    return message


class VelocityPublisher(Node):
    def __init__(self):
        super().__init__("velocity_publisher")
        self.publisher = self.create_publisher(Twist, "/cmd_vel", 10)
        self.create_timer(0.05, self.tick)
        self.count = 0
        self.get_logger().info("driving")

    def tick(self):
        self.publisher.publish(command())
        self.count += 1
        if self.count == 100:
            self.publisher.publish(Twist())
            raise RuntimeError("the battery is empty")


def main():
    rclpy.init()
    rclpy.spin(VelocityPublisher())


if __name__ == "__main__":
    main()
