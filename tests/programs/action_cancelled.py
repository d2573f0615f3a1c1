"""Cancels its goal half-way, with an identifier of its own."""
import rclpy
from rclpy.action import ActionClient
from rclpy.node import Node
from test_msgs.action import Fibonacci
from unique_identifier_msgs.msg import UUID


class Cancels(Node):
    def __init__(self):
        super().__init__("cancels")
        self.client = ActionClient(self, Fibonacci, "/countdown")

    def run(self):
        self.client.wait_for_server()
        future = self.client.send_goal_async(Fibonacci.Goal(order=9), goal_uuid=UUID(uuid=list(range(16))))
        rclpy.spin_until_future_complete(self, future)
        handle = future.result()
        print("goal", [int(n) for n in handle.goal_id.uuid[:4]], flush=True)
        timer = self.create_timer(0.7, lambda: (timer.cancel(), self.cancel(handle)))
        result = handle.get_result_async()
        rclpy.spin_until_future_complete(self, result)
        print("ended with", result.result().status, list(result.result().result.sequence), flush=True)

    def cancel(self, handle):
        handle.cancel_goal_async().add_done_callback(
            lambda future: print("cancelling", len(future.result().goals_canceling), flush=True)
        )


rclpy.init()
Cancels().run()
