"""Counts a step each half second, until it is cancelled."""

import time

import rclpy
from rclpy.action import ActionServer, CancelResponse
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import MultiThreadedExecutor
from test_msgs.action import Fibonacci


def execute(goal):
    for number in range(goal.request.order):
        time.sleep(0.5)
        if goal.is_cancel_requested:
            goal.canceled()
            return Fibonacci.Result(sequence=[number])
        goal.publish_feedback(Fibonacci.Feedback(sequence=[number]))
    goal.succeed()
    return Fibonacci.Result()


rclpy.init()
node = rclpy.create_node("fibonacci")
server = ActionServer(
    node,
    Fibonacci,
    "/fibonacci",
    execute,
    callback_group=ReentrantCallbackGroup(),
    cancel_callback=lambda _: CancelResponse.ACCEPT,
)
rclpy.spin(node, MultiThreadedExecutor(4))
