"""Returns from main right after a last command, without a shutdown."""

import time

import rclpy
from geometry_msgs.msg import Twist
from rclpy.node import Node


def command():
    message = Twist()
    message.linear.x = 0.5
    message.angular.z = 0.1
    return message


def main():
    rclpy.init()
    node = Node("velocity_publisher")
    publisher = node.create_publisher(Twist, "/cmd_vel", 10)
    node.get_logger().info("driving for 5 s")
    for _ in range(100):
        publisher.publish(command())
        time.sleep(0.05)
    publisher.publish(Twist())


if __name__ == "__main__":
    main()
