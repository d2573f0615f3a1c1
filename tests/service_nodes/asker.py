"""Asks another process and itself for a parameter, through the services that every node has."""

import rclpy
from rcl_interfaces.srv import GetParameters
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import MultiThreadedExecutor
from rclpy.node import Node


class Asker(Node):
    def __init__(self):
        super().__init__("asker")
        self.declare_parameter("size", 4)
        group = ReentrantCallbackGroup()
        self._clients = [
            self.create_client(GetParameters, f"{node}/get_parameters", callback_group=group)
            for node in ("/asked", "/asker")
        ]
        self.create_timer(1.0, self.ask, callback_group=group)

    async def ask(self):
        for client in self._clients:
            answer = await client.call_async(GetParameters.Request(names=["size"]))
            self.get_logger().info(f"{client.srv_name}: {answer.values[0].integer_value}")


def main():
    rclpy.init()
    executor = MultiThreadedExecutor()
    executor.add_node(Asker())
    executor.spin()


main()
