"""An executor as the documentation describes one: with `wait_for_ready_callbacks`."""
import rclpy
from rclpy.executors import Executor, ShutdownException, TimeoutException
from rclpy.node import Node


class Counting(Executor):
    def __init__(self):
        super().__init__()
        self.handled = 0

    def spin_once(self, timeout_sec=None):
        try:
            handler, entity, node = self.wait_for_ready_callbacks(timeout_sec=timeout_sec)
        except (TimeoutException, ShutdownException):
            print("nothing", flush=True)
        else:
            handler()
            self.handled += 1
            print(self.handled, type(entity).__name__, node.get_name(), flush=True)


rclpy.init()
node = Node("handled")
node.create_timer(0.5, lambda: print("tick", flush=True))
executor = Counting()
executor.add_node(node)
while executor.handled < 4:
    executor.spin_once(timeout_sec=0.3)
executor.shutdown()
