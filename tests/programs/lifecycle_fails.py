"""A node whose configuration fails, and whose activation raises."""
import time

import rclpy
from rclpy.lifecycle import Node, TransitionCallbackReturn


class Fails(Node):
    def __init__(self):
        super().__init__("fails", enable_communication_interface=False)
        self.tries = 0

    def on_configure(self, state):
        self.tries += 1
        return TransitionCallbackReturn.FAILURE if self.tries == 1 else TransitionCallbackReturn.SUCCESS

    def on_activate(self, state):
        raise RuntimeError("no power")

    def on_error(self, state):
        self.get_logger().error(f"error in {state.label}")
        return TransitionCallbackReturn.SUCCESS


rclpy.init()
node = Fails()
time.sleep(1.5)  # until others hear of the transitions
for step in (node.trigger_configure, node.trigger_configure, node.trigger_activate):
    node.get_logger().info(f"{step.__name__}: {step()}")
    time.sleep(0.5)
