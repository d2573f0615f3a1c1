"""Keeps the last messages of a topic, to answer what was the case at some time."""

import rclpy
from builtin_interfaces.msg import Time as Stamp
from message_filters import Cache, Subscriber
from rclpy.clock import ClockType
from rclpy.node import Node
from rclpy.time import Time
from sensor_msgs.msg import Range


class Remembers(Node):
    def __init__(self):
        super().__init__("remembers")
        self.sub = Subscriber(self, Range, "range")
        self.cache = Cache(self.sub, cache_size=5)
        self.cache.registerCallback(self.heard)
        self.publisher = self.create_publisher(Range, "range", 10)
        self.count = self.got = 0
        self.create_timer(0.1, self.send)

    def send(self):
        self.count += 1
        msg = Range(range=float(self.count))
        msg.header.stamp = Stamp(sec=self.count)
        self.publisher.publish(msg)

    def heard(self, msg):
        self.got += 1
        if self.got < 8:
            return
        last = self.cache.getLast().range

        def at(seconds):
            return Time(seconds=last + seconds, clock_type=ClockType.ROS_TIME)

        between = [m.range - last for m in self.cache.getInterval(at(-3), at(-1))]
        before, after = self.cache.getElemBeforeTime(at(-1.5)), self.cache.getElemAfterTime(at(-1.5))
        self.get_logger().info(f"kept {len(self.cache.cache_msgs)}, between {between}")
        self.get_logger().info(f"before {before.range - last}, after {after.range - last}")
        self.get_logger().info(f"none after {self.cache.getElemAfterTime(at(1))}")
        oldest = self.cache.getOldestTime().nanoseconds / 1e9 - last
        self.get_logger().info(f"from {oldest} to {self.cache.getLastestTime().nanoseconds / 1e9 - last}")
        raise SystemExit


rclpy.init()
rclpy.spin(Remembers())

# logs: kept 5, between [-3.0, -2.0, -1.0]
# logs: before -2.0, after -1.0
# logs: none after None
# logs: from -4.0 to 0.0
