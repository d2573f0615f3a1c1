"""Sends itself a datagram at each tick, as a driver of a device would; right on every clock."""

import socket
import time

import rclpy
from geometry_msgs.msg import Twist
from rclpy.node import Node


class VelocityPublisher(Node):
    def __init__(self):
        super().__init__("velocity_publisher")
        self.publisher = self.create_publisher(Twist, "cmd_vel", 10)
        self.one, self.other = socket.socketpair()
        self.started = time.monotonic(), time.time()
        self.timer = self.create_timer(0.05, self.tick)

    def tick(self):
        self.one.send(b"go")
        message = Twist()
        if self.other.recv(2) == b"go":
            message.linear.x, message.angular.z = 0.5, 0.1
        self.publisher.publish(message)
        apart = (time.monotonic() - self.started[0]) - (time.time() - self.started[1])
        self.get_logger().info(f"the clocks are {apart:.1f} s apart")


def main():
    rclpy.init()
    rclpy.spin(VelocityPublisher())


if __name__ == "__main__":
    main()
