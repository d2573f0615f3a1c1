"""Sends three goals, one after the other, and logs how each ends."""

import rclpy
from action_msgs.msg import GoalStatus
from rclpy.action import ActionClient
from test_msgs.action import Fibonacci

WORDS = {GoalStatus.STATUS_SUCCEEDED: "succeeded", GoalStatus.STATUS_ABORTED: "aborted"}

rclpy.init()
node = rclpy.create_node("client")
client = ActionClient(node, Fibonacci, "/fibonacci")
client.wait_for_server()
for order in (3, 20, -1):
    sent = client.send_goal_async(Fibonacci.Goal(order=order))
    rclpy.spin_until_future_complete(node, sent)
    how = "rejected"
    if sent.result().accepted:
        result = sent.result().get_result_async()
        rclpy.spin_until_future_complete(node, result)
        how = WORDS[result.result().status]
    node.get_logger().info(f"{order}: {how}")
rclpy.spin(node)
