"""Reads parameters from a file, as a launch file would."""
from pathlib import Path

import rclpy
from rclpy.parameter import parameter_dict_from_yaml_file

Path("settings.yaml").write_text(
    "/**:\n  ros__parameters:\n    speed: 2.5\n    names: [a, b]\nother:\n  ros__parameters:\n    size: 4\n"
)
rclpy.init()
node = rclpy.create_node("reader")
for wildcard in (False, True):
    found = parameter_dict_from_yaml_file("settings.yaml", use_wildcard=wildcard)
    node.get_logger().info(f"{wildcard}: {sorted(found)}")
only = parameter_dict_from_yaml_file("settings.yaml", target_nodes=["other"])
node.get_logger().info(f"{only['size'].name} {only['size'].value.integer_value}")
