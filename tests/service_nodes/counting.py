"""Counts up to what a goal asks for, a step each half second, and can be cancelled."""

import time

import rclpy
from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import MultiThreadedExecutor
from rclpy.node import Node
from test_msgs.action import Fibonacci


class Counting(Node):
    def __init__(self):
        super().__init__("counting")
        self.server = ActionServer(
            self,
            Fibonacci,
            "count",
            self.execute,
            goal_callback=lambda goal: GoalResponse.ACCEPT if goal.order < 10 else GoalResponse.REJECT,
            cancel_callback=lambda _: CancelResponse.ACCEPT,
            callback_group=ReentrantCallbackGroup(),
        )

    def execute(self, goal):
        done = Fibonacci.Feedback(sequence=[0])
        while len(done.sequence) <= goal.request.order:
            if goal.is_cancel_requested:
                goal.canceled()
                return Fibonacci.Result(sequence=done.sequence)
            time.sleep(0.5)
            done.sequence.append(len(done.sequence))
            goal.publish_feedback(done)
        goal.succeed()
        return Fibonacci.Result(sequence=done.sequence)


def main():
    rclpy.init()
    executor = MultiThreadedExecutor()
    executor.add_node(Counting())
    executor.spin()


if __name__ == "__main__":
    main()
