"""Sends a goal and tells how it goes on."""

import rclpy
from rclpy.action import ActionClient
from rclpy.node import Node
from test_msgs.action import Fibonacci


def main():
    rclpy.init()
    node = Node("sending")
    client = ActionClient(node, Fibonacci, "count")
    client.wait_for_server()
    log = node.get_logger()
    sent = client.send_goal_async(
        Fibonacci.Goal(order=3), feedback_callback=lambda told: log.info(f"{list(told.feedback.sequence)}")
    )
    rclpy.spin_until_future_complete(node, sent)
    log.info(f"accepted {sent.result().accepted}")
    result = sent.result().get_result_async()
    rclpy.spin_until_future_complete(node, result)
    log.info(f"result {list(result.result().result.sequence)}")
    node.destroy_node()  # the client outlives it
    rclpy.shutdown()


if __name__ == "__main__":
    main()
