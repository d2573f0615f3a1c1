"""Asks the server what 17 and 25 are together, and logs its answer."""

import rclpy
from example_interfaces.srv import AddTwoInts
from rclpy.node import Node


class AddTwoIntsClient(Node):
    """Asks once."""

    def __init__(self):
        super().__init__("add_two_ints_client")
        self.client = self.create_client(AddTwoInts, "add_two_ints")

    def ask(self, a, b):
        """Wait for the server, send the request, and return the response."""
        request = AddTwoInts.Request()
        request.a = a
        request.b = b
        future = self.client.call_async(request)
        rclpy.spin_until_future_complete(self, future, timeout_sec=2.0)
        return future.result()


def main(args=None):
    """Ask, log the answer, and end."""
    rclpy.init(args=args)
    node = AddTwoIntsClient()
    response = node.ask(17, 25)
    node.get_logger().info(f"17 + 25 = {response.sum}")
    node.destroy_node()
    rclpy.try_shutdown()


if __name__ == "__main__":
    main()
