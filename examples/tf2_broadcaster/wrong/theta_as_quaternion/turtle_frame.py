"""Tells everybody where the turtle is: its pose as a transform from world to turtle1."""

import rclpy
from geometry_msgs.msg import TransformStamped
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from tf2_msgs.msg import TFMessage
from turtlesim.msg import Pose


class TurtleFrame(Node):
    """Publishes a transform on /tf for each pose on /turtle1/pose."""

    def __init__(self):
        super().__init__("turtle_frame")
        self.publisher = self.create_publisher(TFMessage, "/tf", 100)
        self.create_subscription(Pose, "/turtle1/pose", self.on_pose, 10)

    def on_pose(self, pose):
        """Publish the transform of a pose: a turn by theta about z is a quaternion with half the angle."""
        moved = TransformStamped()
        moved.header.stamp = self.get_clock().now().to_msg()
        moved.header.frame_id = "world"
        moved.child_frame_id = "turtle1"
        moved.transform.translation.x = pose.x
        moved.transform.translation.y = pose.y
        moved.transform.rotation.z = pose.theta
        moved.transform.rotation.w = 1.0
        self.publisher.publish(TFMessage(transforms=[moved]))


def main(args=None):
    """Run the node until Ctrl-C."""
    rclpy.init(args=args)
    node = TurtleFrame()
    try:
        rclpy.spin(node)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        node.destroy_node()
        rclpy.try_shutdown()


if __name__ == "__main__":
    main()
