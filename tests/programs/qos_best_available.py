"""Subscribes with whatever the publisher offers."""
import rclpy
from rclpy.qos import QoSPresetProfiles
from std_msgs.msg import Int32

rclpy.init()
node = rclpy.create_node("any_qos")
heard = []


def hear(message):
    heard.append(message.data)
    if len(heard) == 4:
        node.get_logger().info(f"steps {[b - a for a, b in zip(heard, heard[1:])]}")


def subscribe():
    timer.cancel()
    subscription = node.create_subscription(Int32, "/count", hear, QoSPresetProfiles.BEST_AVAILABLE.value)
    node.get_logger().info(subscription.topic_name)


timer = node.create_timer(0.5, subscribe)
rclpy.spin(node)
