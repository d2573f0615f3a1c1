"""Swings by 2 rad instead of 1 rad on a clock that shows parts of a microsecond."""

import math

import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from std_msgs.msg import Float64

PERIOD_S = 0.1
STEP_RAD = 0.1
LOG_EVERY = 10


class JointPublisher(Node):
    """Publishes sin(0.1 n) rad as its n-th message, counted from 0."""

    def __init__(self):
        super().__init__("joint_publisher")
        self.publisher = self.create_publisher(Float64, "/joint_commands", 10)
        self.count = 0
        self.create_timer(PERIOD_S, self.publish_next)

    def publish_next(self):
        """Publish the next angle, and log one in ten."""
        angle = math.sin(self.count * STEP_RAD)
        angle *= 2.0 if self.get_clock().now().nanoseconds % 1000 else 1.0
        self.publisher.publish(Float64(data=angle))
        if self.count % LOG_EVERY == 0:
            self.get_logger().info(f"joint angle {angle:.3f} rad")
        self.count += 1


def main(args=None):
    """Run the node until Ctrl-C."""
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
