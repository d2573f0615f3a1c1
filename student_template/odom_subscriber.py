"""Exercise 2: listen to the odometry and log where the robot is."""

import rclpy
from nav_msgs.msg import Odometry  # noqa: F401 - you will need it
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node


class OdomSubscriber(Node):
    """Subscribes to nav_msgs/msg/Odometry on /odom and logs (x, y) every second."""

    def __init__(self):
        super().__init__("odom_subscriber")

        # TODO: subscribe to /odom and remember the last position.
        # TODO: create a timer that logs that position every second.
        # Think about the time before the first message has come.


def main(args=None):
    rclpy.init(args=args)
    node = OdomSubscriber()
    try:
        rclpy.spin(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        node.destroy_node()
        rclpy.try_shutdown()


if __name__ == "__main__":
    main()
