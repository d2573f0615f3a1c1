"""Sleeps in the C library, which no clock of Python notices."""

import ctypes

import rclpy
from geometry_msgs.msg import Twist
from rclpy.node import Node

LIBRARY = ctypes.CDLL(None)


class VelocityPublisher(Node):
    def __init__(self):
        super().__init__("velocity_publisher")
        self.publisher = self.create_publisher(Twist, "/cmd_vel", 10)
        self.create_timer(0.05, self.tick)
        self.get_logger().info("driving")

    def drive(self):
        message = Twist()
        message.linear.x = 0.5
        message.angular.z = 0.1
        self.publisher.publish(message)

    def tick(self):
        LIBRARY.usleep(100_000)
        self.drive()


def main():
    rclpy.init()
    rclpy.spin(VelocityPublisher())


if __name__ == "__main__":
    main()
