"""A depth camera in metres: the distance in the middle, without the pixels that know none."""

import numpy as np
import rclpy
from cv_bridge import CvBridge
from rclpy.node import Node
from sensor_msgs.msg import Image


class Depth(Node):
    def __init__(self):
        super().__init__("depth")
        self.cv_bridge = CvBridge()
        self.publisher = self.create_publisher(Image, "/camera/depth", 10)
        self.create_subscription(Image, "/camera/depth", self.callback, 10)
        self.create_timer(0.1, self.send)

    def send(self):
        depth = np.full((5, 7), 2.5, dtype=np.float32)
        depth[0, :] = np.nan
        depth[2, 3] = 1.25
        self.publisher.publish(self.cv_bridge.cv2_to_imgmsg(depth, encoding="32FC1"))

    def callback(self, msg):
        depth = self.cv_bridge.imgmsg_to_cv2(msg, desired_encoding="passthrough")
        middle = depth[msg.height // 2, msg.width // 2]
        self.get_logger().info(f"{msg.encoding}: {middle:.2f} m, mean {np.nanmean(depth):.2f} m, step {msg.step}")
        raise SystemExit


rclpy.init()
rclpy.spin(Depth())

# logs: 32FC1: 1.25 m, mean 2.46 m, step 28
