"""Several callbacks of one filter, with arguments of their own, in the order in which they were registered."""

import rclpy
from builtin_interfaces.msg import Time
from geometry_msgs.msg import PointStamped
from message_filters import Chain, SimpleFilter, TimeSynchronizer

rclpy.init()
log = rclpy.create_node("several").get_logger().info
left, right = SimpleFilter(), SimpleFilter()
sync = TimeSynchronizer([left, right], 10)
sync.registerCallback(lambda a, b, word, number: log(f"{word} {number}: {a.point.x} {b.point.x}"), "first", 1)
sync.registerCallback(lambda a, b: log(f"second: {a.point.x + b.point.x}"))


class Doubled(SimpleFilter):
    def add(self, message):
        message.point.x *= 2
        self.signalMessage(message)


chain = Chain(left)
chain.addFilter(Doubled())
chain.addFilter(Doubled())
chain.registerCallback(lambda message: log(f"four times: {message.point.x}"))
for filter_, x in ((right, 1.0), (left, 2.0)):
    message = PointStamped()
    message.header.stamp, message.point.x = Time(sec=5), x
    filter_.signalMessage(message)
rclpy.shutdown()

# logs: first 1: 2.0 1.0
# logs: second: 3.0
# logs: four times: 8.0
