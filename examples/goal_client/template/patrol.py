"""Sends a robot on patrol: from one place to the next by the action of Nav2."""

import rclpy
from nav2_msgs.action import NavigateToPose
from rclpy.action import ActionClient
from rclpy.node import Node

PLACES = [(1.0, 0.0), (1.0, 2.0), (-1.0, 2.0)]
MOST_RECOVERIES = 3


class Patrol(Node):
    """Sends one goal after the other."""

    def __init__(self):
        super().__init__("patrol")
        self.client = ActionClient(self, NavigateToPose, "navigate_to_pose")
        # TODO: wait for the server, then send the first goal

    def send(self):
        """Send the goal of the place whose turn it is."""
        # TODO: the pose is in the frame "map"

    def on_answer(self, future):
        """Wait for the result, or try again if the goal was rejected."""
        # TODO

    def on_feedback(self, message):
        """Log how far it is, and give up a place that takes too many recoveries."""
        # TODO

    def on_result(self, future):
        """Log what has become of the goal, and go on with the next place."""
        # TODO


def main(args=None):
    """Patrol until somebody stops the node."""
    rclpy.init(args=args)
    rclpy.spin(Patrol())


if __name__ == "__main__":
    main()
