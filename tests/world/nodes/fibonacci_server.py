"""Computes Fibonacci numbers, one every half second, and tells how far it is; refuses an order below 0."""

import threading

import rclpy
from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import ExternalShutdownException, MultiThreadedExecutor
from rclpy.node import Node
from test_msgs.action import Fibonacci

PAUSE_S = 0.5


class FibonacciServer(Node):
    """Offers the action /fibonacci."""

    def __init__(self):
        super().__init__("fibonacci_server")
        self.server = ActionServer(
            self,
            Fibonacci,
            "fibonacci",
            self.execute,
            goal_callback=self.on_goal,
            cancel_callback=self.on_cancel,
            callback_group=ReentrantCallbackGroup(),
        )
        self.pause = threading.Event()

    def on_goal(self, goal):
        """Refuse an order below 0."""
        return GoalResponse.REJECT if goal.order < 0 else GoalResponse.ACCEPT

    def on_cancel(self, goal_handle):
        """Let everybody cancel."""
        return CancelResponse.ACCEPT

    def execute(self, goal_handle):
        """Compute the numbers up to the order, with feedback after each, until cancelled."""
        sequence = [0, 1]
        order = goal_handle.request.order
        while len(sequence) <= order and not goal_handle.is_cancel_requested:
            sequence.append(sequence[-1] + sequence[-2])
            goal_handle.publish_feedback(Fibonacci.Feedback(sequence=sequence))
            self.pause.wait(PAUSE_S)
        if goal_handle.is_cancel_requested:
            goal_handle.canceled()
        else:
            goal_handle.succeed()
        return Fibonacci.Result(sequence=sequence[: order + 1])


def main(args=None):
    """Run the node until Ctrl-C; cancelling needs a second thread."""
    rclpy.init(args=args)
    node = FibonacciServer()
    try:
        rclpy.spin(node, executor=MultiThreadedExecutor())
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        node.destroy_node()
        rclpy.try_shutdown()


if __name__ == "__main__":
    main()
