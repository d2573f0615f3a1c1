"""Asks for the Fibonacci numbers up to order 8, and logs feedback and result."""

import rclpy
from example_interfaces.action import Fibonacci
from rclpy.action import ActionClient
from rclpy.node import Node


class FibonacciClient(Node):
    """Sends one goal."""

    def __init__(self):
        super().__init__("fibonacci_client")
        self.client = ActionClient(self, Fibonacci, "fibonacci")

    def ask(self, order):
        """Send a goal and return its result; None if the goal is refused."""
        while not self.client.wait_for_server(timeout_sec=1.0):
            self.get_logger().info("waiting for /fibonacci")
        sending = self.client.send_goal_async(Fibonacci.Goal(order=order))
        rclpy.spin_until_future_complete(self, sending)
        goal_handle = sending.result()
        if not goal_handle.accepted:
            return None
        getting = goal_handle.get_result_async()
        rclpy.spin_until_future_complete(self, getting)
        return getting.result().result

    def on_feedback(self, message):
        """Log how far the server is."""
        self.get_logger().info(f"so far: {list(message.feedback.sequence)}")


def main(args=None):
    """Ask, log the result, and end."""
    rclpy.init(args=args)
    node = FibonacciClient()
    result = node.ask(8)
    if result is None:
        node.get_logger().warning("the goal was refused")
    else:
        node.get_logger().info(f"result: {list(result.sequence)}")
    node.destroy_node()
    rclpy.try_shutdown()


if __name__ == "__main__":
    main()
