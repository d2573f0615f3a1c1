"""Logs every joint angle that comes on /joint_commands, in radians and in degrees."""

import math

import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from std_msgs.msg import Float64


class JointSubscriber(Node):
    """Logs each message as it comes."""

    def __init__(self):
        super().__init__("joint_subscriber")
        self.create_subscription(Float64, "/joint_commands", self.log_angle, 10)

    def log_angle(self, msg):
        """Log one angle in both units."""
        self.get_logger().info(f"joint angle {msg.data:.3f} rad = {math.degrees(msg.data):.1f} deg")


def main(args=None):
    """Run the node until Ctrl-C."""
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
