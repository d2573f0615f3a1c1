"""The tutorial's broadcaster and listener: a pose becomes a frame, and a follower gets a velocity towards it."""

import math

import rclpy
from geometry_msgs.msg import Pose2D, TransformStamped, Twist
from rclpy.node import Node
from tf2_ros import Buffer, TransformBroadcaster, TransformException, TransformListener


class FramePublisher(Node):
    def __init__(self):
        super().__init__("turtle_tf2_frame_publisher")
        self.turtlename = self.declare_parameter("turtlename", "turtle1").get_parameter_value().string_value
        self.tf_broadcaster = TransformBroadcaster(self)
        self.subscription = self.create_subscription(Pose2D, f"/{self.turtlename}/pose", self.handle_turtle_pose, 1)
        self.pose = self.create_publisher(Pose2D, f"/{self.turtlename}/pose", 1)
        self.create_timer(0.05, lambda: self.pose.publish(Pose2D(x=3.0, y=4.0, theta=math.pi / 2)))
        self.buffer = Buffer()
        self.listener = TransformListener(self.buffer, self)
        self.velocity = self.create_publisher(Twist, "/turtle2/cmd_vel", 1)
        self.create_timer(0.1, self.follow)

    def handle_turtle_pose(self, msg):
        t = TransformStamped()
        t.header.stamp = self.get_clock().now().to_msg()
        t.header.frame_id = "world"
        t.child_frame_id = self.turtlename
        t.transform.translation.x = msg.x
        t.transform.translation.y = msg.y
        t.transform.rotation.z = math.sin(msg.theta / 2)
        t.transform.rotation.w = math.cos(msg.theta / 2)
        self.tf_broadcaster.sendTransform(t)

    def follow(self):
        try:
            t = self.buffer.lookup_transform("world", self.turtlename, rclpy.time.Time())
        except TransformException as ex:
            self.get_logger().debug(f"Could not transform: {ex}")
            return
        msg = Twist()
        msg.angular.z = math.atan2(t.transform.translation.y, t.transform.translation.x)
        msg.linear.x = 0.5 * math.hypot(t.transform.translation.x, t.transform.translation.y)
        self.velocity.publish(msg)
        self.get_logger().info(f"forward {msg.linear.x:.2f}, turning {msg.angular.z:.3f}")
        raise SystemExit


def main():
    rclpy.init()
    rclpy.spin(FramePublisher())


if __name__ == "__main__":
    main()

# logs: forward 2.50, turning 0.927
