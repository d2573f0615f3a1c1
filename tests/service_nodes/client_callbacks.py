"""Asks from a timer, and reads the answers in callbacks."""

import rclpy
from rclpy.node import Node
from std_srvs.srv import Trigger


class Asking(Node):
    def __init__(self):
        super().__init__("asking")
        self.client = self.create_client(Trigger, "/battery/get_status")
        self.create_timer(1.0, self.ask)

    def ask(self):
        if not self.client.service_is_ready():
            self.get_logger().warning("not there")
            return
        self.client.call_async(Trigger.Request()).add_done_callback(self.read)

    def read(self, future):
        self.get_logger().info(future.result().message)


def main():
    rclpy.init()
    rclpy.spin(Asking())


if __name__ == "__main__":
    main()
