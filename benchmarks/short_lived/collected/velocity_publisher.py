"""Has a node for each half second, which the garbage collector frees right after its last command."""

import time

import rclpy
from geometry_msgs.msg import Twist
from rclpy.node import Node


def command():
    message = Twist()
    message.linear.x = 0.5
    message.angular.z = 0.1
    return message


def drive(number):
    node = Node(f"velocity_publisher_{number}")
    publisher = node.create_publisher(Twist, "/cmd_vel", 10)
    node.get_logger().info("driving")
    for _ in range(10):
        publisher.publish(command())
        time.sleep(0.05)
    publisher.publish(Twist())


def main():
    rclpy.init()
    for number in range(10):
        drive(number)


if __name__ == "__main__":
    main()
