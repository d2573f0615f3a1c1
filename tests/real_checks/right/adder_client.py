"""Asks once for the sum of two integers."""

import rclpy
from example_interfaces.srv import AddTwoInts


def main():
    rclpy.init()
    node = rclpy.create_node("adder_client")
    client = node.create_client(AddTwoInts, "add_two_ints")
    while not client.wait_for_service(timeout_sec=1.0):
        node.get_logger().info("waiting")
    future = client.call_async(AddTwoInts.Request(a=3, b=4))
    rclpy.spin_until_future_complete(node, future)
    node.get_logger().info(f"sum {future.result().sum}")


if __name__ == "__main__":
    main()
