"""Waits for the battery, asks five times a second apart, and ends."""

import time

import rclpy
from rclpy.node import Node
from std_srvs.srv import Trigger


def main():
    rclpy.init()
    node = Node("asking")
    client = node.create_client(Trigger, "/battery/get_status")
    while not client.wait_for_service(timeout_sec=1.0):
        node.get_logger().info("waiting")
    for _ in range(5):
        future = client.call_async(Trigger.Request())
        rclpy.spin_until_future_complete(node, future, timeout_sec=3.0)
        node.get_logger().info(f"{future.result().message}" if future.done() else "no answer")
        time.sleep(1.0)
    node.destroy_node()
    rclpy.shutdown()


if __name__ == "__main__":
    main()
