"""The partner of a message comes later; a queue that is too short has forgotten it by then."""

import rclpy
from geometry_msgs.msg import PointStamped
from message_filters import ApproximateTimeSynchronizer, Subscriber
from rclpy.node import Node


class Slow(Node):
    def __init__(self):
        super().__init__("slow")
        ends = [Subscriber(self, PointStamped, name) for name in ("fast", "slow")]
        self.got = {"short": 0, "long": 0}
        self.syncs = []
        for name, size in (("short", 2), ("long", 20)):
            sync = ApproximateTimeSynchronizer(ends, size, 0.01)
            sync.registerCallback(lambda a, b, name=name: self.count(name))
            self.syncs.append(sync)
        self.fast = self.create_publisher(PointStamped, "fast", 10)
        self.slow = self.create_publisher(PointStamped, "slow", 10)
        self.sent = []
        self.create_timer(0.05, self.send)

    def send(self):
        message = PointStamped()
        message.header.stamp = self.get_clock().now().to_msg()
        self.fast.publish(message)
        self.sent.append(message)
        if len(self.sent) > 8:
            self.slow.publish(self.sent.pop(0))

    def count(self, name):
        self.got[name] += 1
        if self.got["long"] == 5:
            self.get_logger().info(f"{self.got['short']} with the short queue, {self.got['long']} with the long one")
            raise SystemExit


rclpy.init()
rclpy.spin(Slow())

# logs: 0 with the short queue, 5 with the long one
