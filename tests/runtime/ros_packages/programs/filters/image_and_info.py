"""The example of the documentation: an image and the camera's information of the same instant."""

import rclpy
from message_filters import Subscriber, TimeSynchronizer
from rclpy.node import Node
from sensor_msgs.msg import CameraInfo, Image


class MyNode(Node):
    def __init__(self):
        super().__init__("camera")
        self.image_sub = Subscriber(self, Image, "image")
        self.info_sub = Subscriber(self, CameraInfo, "camera_info")
        self.ts = TimeSynchronizer([self.image_sub, self.info_sub], 10)
        self.ts.registerCallback(self.callback)
        self.image_pub = self.create_publisher(Image, "image", 10)
        self.info_pub = self.create_publisher(CameraInfo, "camera_info", 10)
        self.create_timer(0.1, self.send)

    def send(self):
        stamp = self.get_clock().now().to_msg()
        image, info = Image(width=4, height=2), CameraInfo(width=4, height=2)
        image.header.stamp = info.header.stamp = stamp
        self.info_pub.publish(info)
        self.image_pub.publish(image)

    def callback(self, image, camera_info):
        assert image.header.stamp == camera_info.header.stamp
        self.get_logger().info(f"{image.width}x{camera_info.height}, from {self.image_sub.getTopic()}")
        raise SystemExit


rclpy.init()
rclpy.spin(MyNode())

# logs: 4x2, from image
