"""Without permission, messages without stamps are left out, with a warning."""

import rclpy
from message_filters import ApproximateTimeSynchronizer, Cache, SimpleFilter
from std_msgs.msg import Float32

rclpy.init()
node = rclpy.create_node("refused")
source, other = SimpleFilter(), SimpleFilter()
cache = Cache(source)
sync = ApproximateTimeSynchronizer([source, other], 10, 0.5)
got = []
sync.registerCallback(lambda *messages: got.append(messages))
source.signalMessage(Float32(data=1.0))
other.signalMessage(Float32(data=1.0))
node.get_logger().info(f"{len(got)} sets, {cache.getLast()}")
rclpy.shutdown()

# warns: 3
# logs: 0 sets, None
