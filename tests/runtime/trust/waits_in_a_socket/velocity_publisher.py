"""Reads from a socket on which nothing comes, as a driver does, with a timeout of 0.1 s."""

import socket

import rclpy
from geometry_msgs.msg import Twist
from rclpy.node import Node


class VelocityPublisher(Node):
    def __init__(self):
        super().__init__("velocity_publisher")
        self.publisher = self.create_publisher(Twist, "/cmd_vel", 10)
        self.create_timer(0.05, self.tick)
        self.get_logger().info("driving")
        self.device = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.device.bind(("127.0.0.1", 0))
        self.device.settimeout(0.1)

    def drive(self):
        message = Twist()
        message.linear.x = 0.5
        message.angular.z = 0.1
        self.publisher.publish(message)

    def tick(self):
        try:
            self.device.recv(100)
        except TimeoutError:
            pass
        self.drive()


def main():
    rclpy.init()
    rclpy.spin(VelocityPublisher())


if __name__ == "__main__":
    main()
