"""Pairs that lie further apart than allowed, or exactly as far, are never passed on."""

import rclpy
from builtin_interfaces.msg import Time
from geometry_msgs.msg import PointStamped
from message_filters import ApproximateTimeSynchronizer, SimpleFilter

rclpy.init()
node = rclpy.create_node("strict")


def count(slop, apart):
    one, other = SimpleFilter(), SimpleFilter()
    passed = []
    sync = ApproximateTimeSynchronizer([one, other], 10, slop)
    sync.registerCallback(lambda *messages: passed.append(messages))
    for second in range(5):
        first, later = PointStamped(), PointStamped()
        first.header.stamp = Time(sec=10 + second)
        later.header.stamp = Time(sec=10 + second, nanosec=apart)
        one.signalMessage(first)
        other.signalMessage(later)
    return len(passed)


node.get_logger().info(f"{count(0.1, 50_000_000)} within, {count(0.1, 100_000_000)} at and {count(0.1, 200_000_000)} beyond")
rclpy.shutdown()

# logs: 5 within, 0 at and 0 beyond
