"""A server that decides about goals, starts them later, and is asked by its own client."""
import rclpy
from rclpy.action import ActionClient, ActionServer, CancelResponse, GoalResponse
from rclpy.action.server import ServerGoalHandle, default_cancel_callback
from rclpy.node import Node
from test_msgs.action import Fibonacci


class Later(Node):
    def __init__(self):
        super().__init__("later")
        self.server = ActionServer(
            self, Fibonacci, "own", self.execute, goal_callback=self.decide,
            handle_accepted_callback=self.accepted, result_timeout=10,
        )
        self.server.register_cancel_callback(default_cancel_callback)
        self.client = ActionClient(self, Fibonacci, "own")
        self.waiting = []
        self.orders = [1, 7, 2]
        self.create_timer(0.5, self.tick)

    def decide(self, goal):
        self.get_logger().info(f"asked for {goal.order}")
        return GoalResponse.REJECT if goal.order > 5 else GoalResponse.ACCEPT

    def accepted(self, handle: ServerGoalHandle):
        self.get_logger().info(f"accepted, active {handle.is_active}")
        self.waiting.append(handle)

    def execute(self, handle):
        self.get_logger().info(f"executes {handle.request.order}")
        if handle.request.order == 1:
            handle.succeed()
        else:
            handle.abort()
        return Fibonacci.Result(sequence=[handle.request.order])

    def tick(self):
        if self.orders:
            self.client.send_goal_async(Fibonacci.Goal(order=self.orders.pop(0))).add_done_callback(self.answered)
        elif self.waiting:
            self.waiting.pop(0).execute()

    def answered(self, future):
        if future.result().accepted:
            future.result().get_result_async().add_done_callback(
                lambda result: self.get_logger().info(f"{result.result().status} {list(result.result().result.sequence)}")
            )


rclpy.init()
rclpy.spin(Later())
