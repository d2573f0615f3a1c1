"""Loads a parameter file into the node beside it, and hears that it changes."""
import rclpy
from rclpy.parameter_client import AsyncParameterClient

with open("partner.yaml", "w") as file:
    file.write("partner:\n  ros__parameters:\n    size: 11\n")
rclpy.init()
node = rclpy.create_node("loader")
client = AsyncParameterClient(node, "partner")
# Messages on /parameter_events are not waited for, and those of a node's beginning may come or not.
heard = []
client.on_parameter_event(lambda event: heard.extend((event.node, p.name) for p in event.changed_parameters))
client.wait_for_services(timeout_sec=3.0)
future = client.load_parameter_file("partner.yaml", use_wildcard=True)
rclpy.spin_until_future_complete(node, future)
print([result.successful for result in future.result().results], flush=True)
future = client.get_parameters(["size"])
rclpy.spin_until_future_complete(node, future)
print(future.result().values[0].integer_value, flush=True)
while not heard:
    rclpy.spin_once(node, timeout_sec=0.1)
print(*heard[0], flush=True)
