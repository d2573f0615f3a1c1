"""Offers /enable, and asks /allowed before it agrees; counts on /count while it is enabled."""

import rclpy
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.executors import MultiThreadedExecutor
from rclpy.node import Node
from std_msgs.msg import Int32
from std_srvs.srv import SetBool, Trigger


class Switch(Node):
    """A server that is a client as well."""

    def __init__(self):
        super().__init__("switch")
        self.declare_parameter("step", 1)
        self.count, self.enabled = 0, False
        self.counts = self.create_publisher(Int32, "/count", 10)
        self.allowed = self.create_client(Trigger, "/allowed", callback_group=MutuallyExclusiveCallbackGroup())
        self.create_service(SetBool, "/enable", self.on_enable)
        self.create_timer(0.1, self.on_timer, callback_group=MutuallyExclusiveCallbackGroup())

    def on_enable(self, request, response):
        """Ask, and do what was asked for if it is allowed."""
        answer = self.allowed.call(Trigger.Request())
        self.enabled = request.data and answer.success
        response.success, response.message = answer.success, answer.message
        return response

    def on_timer(self):
        """Count."""
        if self.enabled:
            self.count += self.get_parameter("step").value
            self.counts.publish(Int32(data=self.count))


rclpy.init()
executor = MultiThreadedExecutor()
executor.add_node(Switch())
executor.spin()
