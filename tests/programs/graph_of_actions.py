"""Lists the actions of all nodes, and of one."""
import rclpy
from rclpy.action import (
    ActionClient,
    get_action_client_names_and_types_by_node,
    get_action_names_and_types,
    get_action_server_names_and_types_by_node,
)
from test_msgs.action import Fibonacci

rclpy.init()
node = rclpy.create_node("lists_actions")
client = ActionClient(node, Fibonacci, "/countdown")
print(client.wait_for_server(timeout_sec=3.0), flush=True)
for _ in range(5):
    rclpy.spin_once(node, timeout_sec=0.1)
print(get_action_names_and_types(node), flush=True)
print(get_action_server_names_and_types_by_node(node, "partner", "/"), flush=True)
print(get_action_client_names_and_types_by_node(node, "lists_actions", "/"), flush=True)
