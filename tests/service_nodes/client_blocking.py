"""Asks with the call that blocks, in a thread beside the one that spins."""

import threading
import time

import rclpy
from rclpy.node import Node
from std_srvs.srv import Trigger


def main():
    rclpy.init()
    node = Node("asking")
    client = node.create_client(Trigger, "/battery/get_status")
    threading.Thread(target=rclpy.spin, args=(node,), daemon=True).start()
    client.wait_for_service()
    for _ in range(3):
        node.get_logger().info(client.call(Trigger.Request()).message)
        time.sleep(1.0)


if __name__ == "__main__":
    main()
