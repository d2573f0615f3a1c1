"""Sends a goal and waits for it in a thread of its own, with the blocking calls."""
import threading

import rclpy
from rclpy.action import ActionClient
from rclpy.executors import MultiThreadedExecutor
from test_msgs.action import Fibonacci

rclpy.init()
node = rclpy.create_node("blocking_goal")
client = ActionClient(node, Fibonacci, "/countdown", result_service_qos_profile=rclpy.qos.qos_profile_services_default)
executor = MultiThreadedExecutor(2)
executor.add_node(node)
threading.Thread(target=executor.spin, daemon=True).start()
client.wait_for_server()
answer = client.send_goal(Fibonacci.Goal(order=2), feedback_callback=lambda m: print(list(m.feedback.sequence), flush=True))
print(answer.status, list(answer.result.sequence), flush=True)
handle = None
future = client.send_goal_async(Fibonacci.Goal(order=-1))
while not future.done():
    pass
handle = future.result()
print("accepted", handle.accepted, flush=True)
executor.shutdown()
