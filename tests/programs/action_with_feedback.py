"""Asks for a countdown, prints the feedback and the result, as in the tutorial."""
import rclpy
from action_msgs.msg import GoalStatus
from rclpy.action import ActionClient
from rclpy.node import Node
from test_msgs.action import Fibonacci


class Asks(Node):
    def __init__(self):
        super().__init__("asks")
        self.client = ActionClient(self, Fibonacci, "/countdown")
        self.client.wait_for_server()
        self.create_timer(0.5, self.go).callback_group = None or self.default_callback_group
        self.sent = False

    def go(self):
        if self.sent:
            return
        self.sent = True
        self.client.send_goal_async(Fibonacci.Goal(order=3), feedback_callback=self.feedback).add_done_callback(self.accepted)

    def feedback(self, message):
        self.get_logger().info(f"feedback {list(message.feedback.sequence)}")

    def accepted(self, future):
        handle = future.result()
        self.get_logger().info(f"accepted {handle.accepted} {len(handle.goal_id.uuid)}")
        handle.get_result_async().add_done_callback(self.ended)

    def ended(self, future):
        self.get_logger().info(f"{list(future.result().result.sequence)}")
        self.get_logger().info(f"{future.result().status == GoalStatus.STATUS_SUCCEEDED}")


rclpy.init()
rclpy.spin(Asks())
