"""A topic without stamps counts by the time of its arrival, if that is allowed."""

import rclpy
from geometry_msgs.msg import PoseStamped
from message_filters import ApproximateTimeSynchronizer, Subscriber
from rclpy.node import Node
from std_msgs.msg import Float32


class Mixed(Node):
    def __init__(self):
        super().__init__("mixed")
        self.ends = [Subscriber(self, PoseStamped, "pose"), Subscriber(self, Float32, "battery")]
        self.sync = ApproximateTimeSynchronizer(self.ends, 10, 0.5, allow_headerless=True)
        self.sync.registerCallback(self.both)
        self.pose = self.create_publisher(PoseStamped, "pose", 10)
        self.battery = self.create_publisher(Float32, "battery", 10)
        self.create_timer(0.3, self.send)

    def send(self):
        pose = PoseStamped()
        pose.header.stamp = self.get_clock().now().to_msg()
        self.pose.publish(pose)
        self.battery.publish(Float32(data=0.75))

    def both(self, pose, battery):
        self.get_logger().info(f"{type(pose).__name__} and {battery.data}")
        raise SystemExit


rclpy.init()
rclpy.spin(Mixed())

# logs: PoseStamped and 0.75
