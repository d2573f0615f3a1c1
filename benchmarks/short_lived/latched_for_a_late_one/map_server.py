"""Publishes once on a latched topic and leaves 5 s later, after somebody came late."""

import time

import rclpy
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from std_msgs.msg import String


def main():
    rclpy.init()
    node = Node("map_server")
    publisher = node.create_publisher(String, "/map", QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL))
    publisher.publish(String(data="two rooms and a corridor"))
    time.sleep(5.0)
    node.destroy_node()
    rclpy.shutdown()


if __name__ == "__main__":
    main()
