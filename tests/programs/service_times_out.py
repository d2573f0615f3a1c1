"""Calls with a time-out, in a thread, a service that answers too late."""
import threading
import time

import rclpy
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import MultiThreadedExecutor
from std_srvs.srv import Trigger

rclpy.init()
node = rclpy.create_node("late")
group = ReentrantCallbackGroup()


def answer(request, response):
    time.sleep(0.8)
    response.message = "late"
    return response


node.create_service(Trigger, "late", answer, callback_group=group)
client = node.create_client(Trigger, "late", callback_group=group)
executor = MultiThreadedExecutor(3)
executor.add_node(node)
threading.Thread(target=executor.spin, daemon=True).start()
client.wait_for_service()
try:
    print(client.call(Trigger.Request(), timeout_sec=0.3), flush=True)
except TimeoutError as error:
    print("timed out", flush=True)
print(client.call(Trigger.Request(), timeout_sec=3.0).message, flush=True)
