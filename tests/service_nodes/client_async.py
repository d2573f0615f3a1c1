"""Awaits the answers in a callback of a group that may run twice at once."""

import rclpy
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.node import Node
from std_srvs.srv import Trigger


class Asking(Node):
    def __init__(self):
        super().__init__("asking")
        group = ReentrantCallbackGroup()
        self.client = self.create_client(Trigger, "/battery/get_status", callback_group=group)
        self.create_timer(1.0, self.ask, callback_group=group)

    async def ask(self):
        answer = await self.client.call_async(Trigger.Request())
        self.get_logger().info(answer.message)


def main():
    rclpy.init()
    rclpy.spin(Asking())


if __name__ == "__main__":
    main()
