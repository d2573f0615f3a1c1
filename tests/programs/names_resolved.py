"""Resolves names as the node would."""
import rclpy
from rclpy.expand_topic_name import expand_topic_name
from rclpy.topic_or_service_is_hidden import topic_or_service_is_hidden

rclpy.init()
node = rclpy.create_node("robot", namespace="room", cli_args=["--ros-args", "-r", "scan:=laser"])
for name in ("scan", "/scan", "~/scan", "sub/scan"):
    print(name, node.resolve_topic_name(name), node.resolve_topic_name(name, only_expand=True))
print(node.resolve_service_name("reset"), node.resolve_service_name("~/reset", only_expand=True))
print(expand_topic_name("{node}/{ns}", "robot", "/room"))
print(topic_or_service_is_hidden("/_hidden"), topic_or_service_is_hidden("/shown"))
