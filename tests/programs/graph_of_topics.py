"""Watches the topics and their ends, like `ros2 topic list -t`."""
import rclpy
from std_msgs.msg import Int32

rclpy.init()
node = rclpy.create_node("topics")
subscription = node.create_subscription(Int32, "/count", lambda message: None, 10)


def show():
    timer.cancel()
    for name, types in node.get_topic_names_and_types(no_demangle=False):
        if name == "/count":
            node.get_logger().info(f"{name}: {types}")
    node.get_logger().info(f"publishers: {subscription.get_publisher_count()}")
    for end in node.get_publishers_info_by_topic("/count", no_mangle=False):
        node.get_logger().info(f"{end.node_namespace}{end.node_name} {end.topic_type} {end.endpoint_type.name}")
    mine = [end for end in node.get_subscriptions_info_by_topic("/count") if end.node_name == "topics"]
    node.get_logger().info(f"{len(mine)} {mine[0].qos_profile.reliability.name} {len(mine[0].topic_type_hash.value)}")


timer = node.create_timer(1.5, show)
rclpy.spin(node)
