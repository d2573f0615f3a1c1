"""A server that answers one question and leaves."""

import rclpy
from rclpy.node import Node
from std_srvs.srv import Trigger


class Once(Node):
    def __init__(self):
        super().__init__("once")
        self.create_service(Trigger, "/once", self.answer)
        self.answered = False

    def answer(self, _request, response):
        self.answered = response.success = True
        response.message = "the only answer"
        return response


def main():
    rclpy.init()
    node = Once()
    while not node.answered:
        rclpy.spin_once(node)
    node.destroy_node()
    rclpy.shutdown()


if __name__ == "__main__":
    main()
