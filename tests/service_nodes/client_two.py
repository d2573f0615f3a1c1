"""Has two clients of one service, of which only one asks."""

import rclpy
from rclpy.node import Node
from std_srvs.srv import Trigger


def main():
    rclpy.init()
    node = Node("asking")
    quiet = node.create_client(Trigger, "/battery/get_status")
    client = node.create_client(Trigger, "/battery/get_status")
    quiet.wait_for_service()

    def ask():
        client.call_async(Trigger.Request()).add_done_callback(lambda f: node.get_logger().info(f.result().message))

    node.create_timer(0.5, ask)
    while rclpy.ok():
        rclpy.spin_once(node, timeout_sec=0.2)
        node.get_logger().debug("looked")


if __name__ == "__main__":
    main()
