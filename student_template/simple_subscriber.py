"""Project 2: follow the commands of a joint."""

import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node

# TODO: import the message type that you receive.


class JointSubscriber(Node):
    """Subscribes to /joint_commands."""

    def __init__(self):
        super().__init__("joint_subscriber")

        # TODO: subscribe to std_msgs/msg/Float64 on /joint_commands.
        # TODO: log each angle in radians and in degrees.


def main(args=None):
    rclpy.init(args=args)
    node = JointSubscriber()
    try:
        rclpy.spin(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        node.destroy_node()
        rclpy.try_shutdown()


if __name__ == "__main__":
    main()
