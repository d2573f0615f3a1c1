"""Cuts a region out of an image and sends it on with the header of the whole."""

import numpy as np
import rclpy
from cv_bridge import CvBridge
from rclpy.node import Node
from sensor_msgs.msg import Image


class Region(Node):
    def __init__(self):
        super().__init__("region")
        self.bridge = CvBridge()
        self.whole = self.create_publisher(Image, "whole", 10)
        self.part = self.create_publisher(Image, "part", 10)
        self.create_subscription(Image, "whole", self.cut, 10)
        self.create_subscription(Image, "part", self.show, 10)
        self.create_timer(0.1, self.send)

    def send(self):
        frame = np.arange(8 * 6 * 3, dtype=np.uint8).reshape(6, 8, 3)
        msg = self.bridge.cv2_to_imgmsg(frame, "rgb8")
        msg.header.frame_id = "camera_link"
        self.whole.publish(msg)

    def cut(self, msg):
        frame = self.bridge.imgmsg_to_cv2(msg)
        self.part.publish(self.bridge.cv2_to_imgmsg(frame[1:3, 2:5], encoding=msg.encoding, header=msg.header))

    def show(self, msg):
        frame = self.bridge.imgmsg_to_cv2(msg)
        self.get_logger().info(f"{msg.width}x{msg.height} of {msg.header.frame_id}, step {msg.step}")
        self.get_logger().info(f"{frame[0, 0].tolist()} {frame[-1, -1].tolist()}")
        raise SystemExit


rclpy.init()
rclpy.spin(Region())

# logs: 3x2 of camera_link, step 9
# logs: [30, 31, 32] [60, 61, 62]
