"""Images as compressed messages: PNG keeps each pixel, JPEG about."""

import numpy as np
import rclpy
from cv_bridge import CvBridge
from rclpy.node import Node
from sensor_msgs.msg import CompressedImage


class Compressed(Node):
    def __init__(self):
        super().__init__("compressed")
        self.bridge = CvBridge()
        self.frame = np.zeros((20, 30, 3), dtype=np.uint8)
        self.frame[:, :15] = (200, 100, 50)
        self.publisher = self.create_publisher(CompressedImage, "image/compressed", 10)
        self.create_subscription(CompressedImage, "image/compressed", self.listen, 10)
        self.create_timer(0.1, self.send)
        self.seen = set()

    def send(self):
        self.publisher.publish(self.bridge.cv2_to_compressed_imgmsg(self.frame, dst_format="png"))
        self.publisher.publish(self.bridge.cv2_to_compressed_imgmsg(self.frame))

    def listen(self, msg):
        found = self.bridge.compressed_imgmsg_to_cv2(msg)
        near = bool(np.abs(found.astype(int) - self.frame.astype(int)).mean() < 5)
        if msg.format not in self.seen:
            self.seen.add(msg.format)
            self.get_logger().info(f"{msg.format}: {found.shape}, smaller {len(msg.data) < found.size}, alike {near}")
        if len(self.seen) == 2:
            raise SystemExit


rclpy.init()
rclpy.spin(Compressed())

# needs: cv2
# logs: png: (20, 30, 3), smaller True, alike True
# logs: jpg: (20, 30, 3), smaller True, alike True
