"""Puts the pictures of two cameras side by side, once both are there."""

import numpy as np
import rclpy
from cv_bridge import CvBridge
from message_filters import ApproximateTimeSynchronizer, Subscriber
from rclpy.node import Node
from sensor_msgs.msg import Image


class TwoCameras(Node):
    def __init__(self):
        super().__init__("two_cameras")
        self.bridge = CvBridge()
        ends = [Subscriber(self, Image, name) for name in ("left", "right")]
        self.sync = ApproximateTimeSynchronizer(ends, 5, 0.1)
        self.sync.registerCallback(self.join)
        self.pubs = [self.create_publisher(Image, name, 10) for name in ("left", "right")]
        self.create_timer(0.2, self.send)

    def send(self):
        for number, pub in enumerate(self.pubs):
            msg = self.bridge.cv2_to_imgmsg(np.full((4, 6, 4), 50 + number, np.uint8), "bgra8")
            msg.header.stamp = self.get_clock().now().to_msg()
            pub.publish(msg)

    def join(self, left, right):
        images = [self.bridge.imgmsg_to_cv2(msg, "bgr8") for msg in (left, right)]
        wide = np.hstack(images)
        out = self.bridge.cv2_to_imgmsg(wide, "bgr8")
        self.get_logger().info(f"{out.width}x{out.height}: {wide[0, 0, 0]} and {wide[0, -1, 0]}")
        kind, channels = self.bridge.encoding_to_dtype_with_channels("bgra8")
        self.get_logger().info(f"{kind} {channels}")
        raise SystemExit


rclpy.init()
rclpy.spin(TwoCameras())

# logs: 12x4: 50 and 51
# logs: uint8 4
