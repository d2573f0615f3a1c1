"""Project 1: command a joint to swing."""

import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node

# TODO: import the message type that you publish.


class JointPublisher(Node):
    """Publishes joint angles on /joint_commands."""

    def __init__(self):
        super().__init__("joint_publisher")

        # TODO: publish std_msgs/msg/Float64 on /joint_commands 10 times a second.
        # TODO: the angle is sin(counter * 0.1) in radians; the counter starts at 0 and grows by 1 a message.
        # TODO: log every 10th message.


def main(args=None):
    rclpy.init(args=args)
    node = JointPublisher()
    try:
        rclpy.spin(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        node.destroy_node()
        rclpy.try_shutdown()


if __name__ == "__main__":
    main()
