"""Exercise 1: publish velocity commands for a mobile robot."""

import rclpy
from geometry_msgs.msg import Twist
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node


class VelocityPublisher(Node):
    """Publishes geometry_msgs/msg/Twist on /cmd_vel, 20 times a second."""

    def __init__(self):
        super().__init__("velocity_publisher")

        self.msg = Twist()
        self.msg.linear.x = 0.5  # forward, in m/s
        self.msg.angular.z = 0.1  # to the left (counterclockwise), in rad/s

        # TODO: create a publisher for /cmd_vel.
        # TODO: create a timer that publishes self.msg at 20 Hz.
        # TODO: log something that tells what your node does.


def main(args=None):
    rclpy.init(args=args)
    node = VelocityPublisher()
    try:
        rclpy.spin(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        node.destroy_node()
        rclpy.try_shutdown()


if __name__ == "__main__":
    main()
