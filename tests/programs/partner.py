"""Stands beside each program: counts on /count, answers on /count_up, counts down on /countdown, has a parameter."""
import time

import rclpy
from rclpy.action import ActionServer, CancelResponse, GoalResponse
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import MultiThreadedExecutor
from rclpy.node import Node
from std_msgs.msg import Int32
from std_srvs.srv import Trigger
from test_msgs.action import Fibonacci


class Partner(Node):
    def __init__(self):
        super().__init__("partner")
        self.declare_parameter("size", 3)
        self.number = self.calls = 0
        self.out = self.create_publisher(Int32, "/count", 10)
        self.create_timer(0.3, self.publish)
        self.create_service(Trigger, "/count_up", self.count_up)
        self.server = ActionServer(
            self, Fibonacci, "/countdown", self.count_down, goal_callback=self.decide,
            cancel_callback=lambda handle: CancelResponse.ACCEPT, callback_group=ReentrantCallbackGroup(),
        )

    def publish(self):
        self.number += 1
        self.out.publish(Int32(data=self.number))

    def count_up(self, request, response):
        self.calls += 1
        response.success, response.message = True, str(self.calls)
        return response

    def decide(self, goal):
        return GoalResponse.REJECT if goal.order < 0 else GoalResponse.ACCEPT

    def count_down(self, handle):
        passed = []
        for number in range(handle.request.order, 0, -1):
            if handle.is_cancel_requested:
                handle.canceled()
                return Fibonacci.Result(sequence=passed)
            time.sleep(0.3)
            passed.append(number)
            handle.publish_feedback(Fibonacci.Feedback(sequence=passed))
        handle.succeed()
        return Fibonacci.Result(sequence=passed)


rclpy.init()
executor = MultiThreadedExecutor(4)
executor.add_node(Partner())
executor.spin()
