"""Triggers a guard condition, destroys it, and looks at what the node holds."""
import rclpy

rclpy.init()
node = rclpy.create_node("guarded")
condition = node.create_guard_condition(lambda: print("triggered", flush=True))
before = len(list(node.guards))
for _ in range(2):
    condition.trigger()
    rclpy.spin_once(node, timeout_sec=0.2)
print(node.destroy_guard_condition(condition), len(list(node.guards)) - before, flush=True)
print(len(list(node.timers)), len(list(node.publishers)) > 0, len(list(node.waitables)), flush=True)
try:
    condition.trigger()
except Exception as error:
    print(type(error).__name__, flush=True)
