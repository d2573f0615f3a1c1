"""Hears its own log records on /rosout."""
import rclpy
from rcl_interfaces.msg import Log
from rclpy.qos import DurabilityPolicy, QoSProfile

rclpy.init()
node = rclpy.create_node("echo")
silent = rclpy.create_node("silent", enable_rosout=False)
node.create_subscription(
    Log, "/rosout", lambda record: print("heard", record.name, record.msg, record.level, flush=True)
    if record.name in ("echo", "silent") else None, QoSProfile(depth=50, durability=DurabilityPolicy.TRANSIENT_LOCAL),
)
numbers = iter(range(1, 4))


def tick():
    for number in numbers:
        node.get_logger().warning(f"number {number}")
        silent.get_logger().warning("nobody hears this")
        return


node.create_timer(0.7, tick)
rclpy.spin(node)
