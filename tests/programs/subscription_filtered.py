"""Filters by content, where the middleware can, and takes the messages with their information."""
import rclpy
from rclpy.subscription import Subscription
from std_msgs.msg import Int32

rclpy.init()
node = rclpy.create_node("filtered")


def with_info(message, info):
    print(sorted(info), message.data >= 0, flush=True)


subscription = node.create_subscription(Int32, "/count", with_info, 10)
print(Subscription.CallbackType.WithMessageInfo.name, subscription.logger_name, flush=True)
while rclpy.ok():
    rclpy.spin_once(node, timeout_sec=1.0)
