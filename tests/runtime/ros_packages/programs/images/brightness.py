"""A camera node and one that measures how bright its images are."""

import numpy as np
import rclpy
from cv_bridge import CvBridge
from rclpy.node import Node
from sensor_msgs.msg import Image


class Brightness(Node):
    def __init__(self):
        super().__init__("brightness")
        self.bridge = CvBridge()
        self.publisher = self.create_publisher(Image, "image_raw", 10)
        self.create_subscription(Image, "image_raw", self.listen, 10)
        self.create_timer(0.1, self.send)

    def send(self):
        frame = np.tile(np.arange(0, 240, 10, dtype=np.uint8), (16, 1))
        msg = self.bridge.cv2_to_imgmsg(frame, encoding="mono8")
        msg.header.stamp = self.get_clock().now().to_msg()
        self.publisher.publish(msg)

    def listen(self, msg):
        frame = self.bridge.imgmsg_to_cv2(msg, desired_encoding="mono8")
        self.get_logger().info(f"{msg.width}x{msg.height}, {msg.encoding}, mean {frame.mean():.1f}")
        raise SystemExit


rclpy.init()
rclpy.spin(Brightness())

# logs: 24x16, mono8, mean 115.0
