"""Adds up what a gyroscope measures, in small turns about its own axes."""

import math

import numpy as np
import rclpy
from rclpy.node import Node
from sensor_msgs.msg import Imu
from tf_transformations import (
    euler_from_quaternion,
    quaternion_about_axis,
    quaternion_multiply,
    random_quaternion,
    unit_vector,
    vector_norm,
)


class Gyroscope(Node):
    def __init__(self):
        super().__init__("gyroscope")
        self.orientation, self.count = np.array([0.0, 0.0, 0.0, 1.0]), 0
        self.publisher = self.create_publisher(Imu, "imu", 100)
        self.create_subscription(Imu, "imu", self.listen, 100)
        self.create_timer(0.01, self.send)

    def send(self):
        msg = Imu()
        msg.angular_velocity.z = math.pi / 2
        self.publisher.publish(msg)

    def listen(self, msg):
        rate = np.array([msg.angular_velocity.x, msg.angular_velocity.y, msg.angular_velocity.z])
        step = quaternion_about_axis(vector_norm(rate) * 0.01, unit_vector(rate))
        self.orientation = quaternion_multiply(self.orientation, step)
        self.count += 1
        if self.count == 50:
            yaw = euler_from_quaternion(self.orientation)[2]
            self.get_logger().info(f"after 50 steps: {math.degrees(yaw):.1f}")
            self.get_logger().info(f"of length 1: {abs(vector_norm(random_quaternion()) - 1) < 1e-9}")
            raise SystemExit


rclpy.init()
rclpy.spin(Gyroscope())

# logs: after 50 steps: 45.0
# logs: of length 1: True
