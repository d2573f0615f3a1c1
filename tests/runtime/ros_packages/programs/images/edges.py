"""Uses OpenCV between two messages: grey, edges, and a circle drawn into the picture, in a window."""

import cv2
import numpy as np
import rclpy
from cv_bridge import CvBridge
from rclpy.node import Node
from sensor_msgs.msg import Image


class Edges(Node):
    def __init__(self):
        super().__init__("edges")
        self.br = CvBridge()
        self.publisher_ = self.create_publisher(Image, "video_frames", 10)
        self.subscription = self.create_subscription(Image, "video_frames", self.listener_callback, 10)
        self.timer = self.create_timer(0.1, self.timer_callback)

    def timer_callback(self):
        frame = np.zeros((40, 40, 3), np.uint8)
        cv2.rectangle(frame, (10, 10), (29, 29), (255, 255, 255), -1)
        self.publisher_.publish(self.br.cv2_to_imgmsg(frame, "bgr8"))

    def listener_callback(self, data):
        current_frame = self.br.imgmsg_to_cv2(data, "bgr8")
        gray = cv2.cvtColor(current_frame, cv2.COLOR_BGR2GRAY)
        contours, _ = cv2.findContours(gray, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_SIMPLE)
        x, y, w, h = cv2.boundingRect(contours[0])
        self.get_logger().info(f"{len(contours)} contour: {x} {y} {w} {h}, edges {bool(cv2.Canny(gray, 50, 150).any())}")
        cv2.circle(current_frame, (20, 20), 5, (0, 0, 255), -1)
        cv2.imshow("camera", current_frame)
        cv2.waitKey(1)
        self.get_logger().info(f"{current_frame[20, 20].tolist()}")
        raise SystemExit


rclpy.init()
rclpy.spin(Edges())

# needs: cv2
# logs: 1 contour: 10 10 20 20, edges True
# logs: [0, 0, 255]
