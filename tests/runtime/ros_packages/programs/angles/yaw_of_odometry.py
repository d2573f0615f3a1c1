"""The first use of every course: the heading of a robot from its odometry."""

import math

import rclpy
from nav_msgs.msg import Odometry
from rclpy.node import Node
from tf_transformations import euler_from_quaternion, quaternion_from_euler


class Heading(Node):
    def __init__(self):
        super().__init__("heading")
        self.publisher = self.create_publisher(Odometry, "odom", 10)
        self.create_subscription(Odometry, "odom", self.listen, 10)
        self.create_timer(0.1, self.send)

    def send(self):
        msg = Odometry()
        q = quaternion_from_euler(0.0, 0.0, math.radians(30))
        msg.pose.pose.orientation.x, msg.pose.pose.orientation.y = q[0], q[1]
        msg.pose.pose.orientation.z, msg.pose.pose.orientation.w = q[2], q[3]
        self.publisher.publish(msg)

    def listen(self, msg):
        q = msg.pose.pose.orientation
        (roll, pitch, yaw) = euler_from_quaternion([q.x, q.y, q.z, q.w])
        self.get_logger().info(f"roll {abs(roll):.2f}, pitch {abs(pitch):.2f}, yaw {math.degrees(yaw):.1f} degrees")
        raise SystemExit


rclpy.init()
rclpy.spin(Heading())

# logs: roll 0.00, pitch 0.00, yaw 30.0 degrees
