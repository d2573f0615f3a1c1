"""Answers with what another server says, while two callbacks wait for each other."""

import rclpy
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.executors import MultiThreadedExecutor
from rclpy.node import Node
from std_srvs.srv import Trigger


class Relay(Node):
    def __init__(self):
        super().__init__("relay")
        self.client = self.create_client(
            Trigger, "/battery/get_status", callback_group=MutuallyExclusiveCallbackGroup()
        )
        self.create_service(Trigger, "/relay", self.answer, callback_group=MutuallyExclusiveCallbackGroup())

    def answer(self, request, response):
        told = self.client.call(Trigger.Request())
        response.success, response.message = told.success, f"relayed {told.message}"
        return response


def main():
    rclpy.init()
    executor = MultiThreadedExecutor()
    executor.add_node(Relay())
    executor.spin()


if __name__ == "__main__":
    main()
