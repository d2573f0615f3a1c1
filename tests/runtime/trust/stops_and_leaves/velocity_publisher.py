"""Drives for five seconds, publishes a stop twice, and leaves: the stops must never be lost."""

import time

import rclpy
from geometry_msgs.msg import Twist
from rclpy.node import Node


def main():
    rclpy.init()
    node = Node("velocity_publisher")
    publisher = node.create_publisher(Twist, "/cmd_vel", 10)
    node.get_logger().info("driving for 5 s")
    message = Twist()
    message.linear.x = 0.5
    message.angular.z = 0.1
    for _ in range(100):
        publisher.publish(message)
        time.sleep(0.05)
    publisher.publish(Twist())
    publisher.publish(Twist())
    node.destroy_node()
    rclpy.shutdown()


if __name__ == "__main__":
    main()
