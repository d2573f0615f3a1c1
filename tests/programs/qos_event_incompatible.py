"""Both ends are told that their QoS does not fit, by the callbacks for it."""
import rclpy
from rclpy.event_handler import PublisherEventCallbacks, SubscriptionEventCallbacks
from rclpy.qos import QoSProfile, ReliabilityPolicy, qos_policy_name_from_kind
from std_msgs.msg import String

rclpy.init()
node = rclpy.create_node("mismatch")


def publisher_told(event):
    print("publisher:", event.total_count, qos_policy_name_from_kind(event.last_policy_kind), flush=True)


def subscription_told(event):
    print("subscription:", event.total_count, qos_policy_name_from_kind(event.last_policy_kind), flush=True)


node.create_subscription(
    String, "t", print, QoSProfile(depth=1, reliability=ReliabilityPolicy.RELIABLE),
    event_callbacks=SubscriptionEventCallbacks(incompatible_qos=subscription_told),
)
rclpy.spin_once(node, timeout_sec=0.5)
node.create_publisher(
    String, "t", QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT),
    event_callbacks=PublisherEventCallbacks(incompatible_qos=publisher_told),
)
for _ in range(10):
    rclpy.spin_once(node, timeout_sec=0.2)
print("end")
