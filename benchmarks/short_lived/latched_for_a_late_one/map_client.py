"""Comes late, takes the map, tells it on and leaves."""

import rclpy
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from std_msgs.msg import String


class MapClient(Node):
    def __init__(self):
        super().__init__("map_client")
        self.seen = False
        self.publisher = self.create_publisher(String, "/seen", 10)
        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self.create_subscription(String, "/map", self.take, latched)

    def take(self, message):
        self.publisher.publish(message)
        self.seen = True


def main():
    rclpy.init()
    node = MapClient()
    while not node.seen:
        rclpy.spin_once(node)
    node.destroy_node()
    rclpy.shutdown()


if __name__ == "__main__":
    main()
