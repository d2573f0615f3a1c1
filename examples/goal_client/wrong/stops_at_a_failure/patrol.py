"""Sends a robot on patrol: from one place to the next by the action of Nav2."""

import rclpy
from action_msgs.msg import GoalStatus
from nav2_msgs.action import NavigateToPose
from rclpy.action import ActionClient
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node

PLACES = [(1.0, 0.0), (1.0, 2.0), (-1.0, 2.0)]
MOST_RECOVERIES = 3


class Patrol(Node):
    """Sends one goal after the other."""

    def __init__(self):
        super().__init__("patrol")
        self.client = ActionClient(self, NavigateToPose, "navigate_to_pose")
        self.place = 0
        self.goal_handle = None
        self.again = None
        self.client.wait_for_server()
        self.send()

    def send(self):
        """Send the goal of the place whose turn it is."""
        if self.again is not None:
            self.destroy_timer(self.again)
            self.again = None
        goal = NavigateToPose.Goal()
        goal.pose.header.frame_id = "map"
        goal.pose.header.stamp = self.get_clock().now().to_msg()
        goal.pose.pose.position.x, goal.pose.pose.position.y = PLACES[self.place]
        goal.pose.pose.orientation.w = 1.0
        self.goal_handle = None
        sending = self.client.send_goal_async(goal, feedback_callback=self.on_feedback)
        sending.add_done_callback(self.on_answer)

    def on_answer(self, future):
        """Wait for the result, or try again if the goal was rejected."""
        goal_handle = future.result()
        if not goal_handle.accepted:
            self.get_logger().warning("the goal was rejected, trying again")
            self.again = self.create_timer(1.0, self.send)
            return
        self.goal_handle = goal_handle
        goal_handle.get_result_async().add_done_callback(self.on_result)

    def on_feedback(self, message):
        """Log how far it is, and give up a place that takes too many recoveries."""
        feedback = message.feedback
        self.get_logger().info(f"remaining: {feedback.distance_remaining:.2f} m")
        if feedback.number_of_recoveries >= MOST_RECOVERIES and self.goal_handle is not None:
            self.get_logger().warning("too many recoveries, giving up this place")
            self.goal_handle.cancel_goal_async()
            self.goal_handle = None

    def on_result(self, future):
        """Log what has become of the goal, and go on with the next place."""
        if future.result().status != GoalStatus.STATUS_SUCCEEDED:
            self.get_logger().error("the place was not reached")
            return
        self.place += 1
        if self.place < len(PLACES):
            self.send()
        else:
            self.get_logger().info("patrol finished")


def main(args=None):
    """Patrol until somebody stops the node."""
    rclpy.init(args=args)
    node = Patrol()
    try:
        rclpy.spin(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        node.destroy_node()
        rclpy.try_shutdown()


if __name__ == "__main__":
    main()
