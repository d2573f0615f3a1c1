"""Waits with an executor until a callback has set a future, one callback at a time."""
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.task import Future

rclpy.init()
node = rclpy.create_node("until")
ended, rounds = Future(), 0
node.create_timer(0.3, lambda: print("tick", flush=True))
node.create_timer(1.0, lambda: ended.done() or ended.set_result("enough"))
executor = SingleThreadedExecutor()
executor.add_node(node)
while not ended.done():
    executor.spin_once_until_future_complete(ended, timeout_sec=0.5)
    rounds += 1
print(ended.result(), rounds, executor.context is rclpy.get_default_context(), flush=True)
