"""Switches rclpy's own warning about incompatible QoS off."""
import rclpy
from rclpy.event_handler import PublisherEventCallbacks, SubscriptionEventCallbacks
from rclpy.qos import qos_profile_sensor_data
from std_msgs.msg import String

rclpy.init()
node = rclpy.create_node("quiet")
node.create_subscription(String, "t", print, 10, event_callbacks=SubscriptionEventCallbacks(use_default_callbacks=False))
publisher = node.create_publisher(
    String, "t", qos_profile_sensor_data, event_callbacks=PublisherEventCallbacks(use_default_callbacks=False)
)
node.create_timer(0.5, lambda: publisher.publish(String(data="nobody hears")))
node.create_timer(1.2, lambda: node.get_logger().info(f"heard by {publisher.get_subscription_count() - 1}"))
rclpy.spin(node)
