"""Initialises ROS, asks and shuts down again for each question."""

import re
import time

import rclpy
from rclpy.node import Node
from std_srvs.srv import Trigger


def ask():
    rclpy.init()
    node = Node("battery_client")
    client = node.create_client(Trigger, "/battery/get_status")
    while not client.wait_for_service(timeout_sec=1.0):
        node.get_logger().info("waiting for the battery service")
    future = client.call_async(Trigger.Request())
    rclpy.spin_until_future_complete(node, future, timeout_sec=5.0)
    judge(node, future.result())
    node.destroy_node()
    rclpy.shutdown()


def judge(node, response):
    found = re.search(r"([0-9.]+)%", response.message) if response is not None and response.success else None
    if found is None:
        node.get_logger().error("no reading of the battery")
    elif float(found[1]) > 20.0:
        node.get_logger().info(f"battery at {found[1]} %, the mission starts")
    else:
        node.get_logger().warning(f"battery low ({found[1]} %), mission aborted")


def main():
    for _ in range(5):
        ask()
        time.sleep(1.0)


if __name__ == "__main__":
    main()
