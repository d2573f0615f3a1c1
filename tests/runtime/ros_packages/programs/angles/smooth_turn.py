"""Turns smoothly from one orientation to another, and takes the short way."""

import math

import rclpy
from rclpy.node import Node
from std_msgs.msg import Float64
from tf_transformations import euler_from_quaternion, quaternion_from_euler, quaternion_slerp


class Turns(Node):
    def __init__(self):
        super().__init__("turns")
        self.start, self.goal = quaternion_from_euler(0, 0, 3.0), quaternion_from_euler(0, 0, -3.0)
        self.step = 0
        self.publisher = self.create_publisher(Float64, "yaw", 10)
        self.create_timer(0.1, self.turn)

    def turn(self):
        q = quaternion_slerp(self.start, self.goal, self.step / 4)
        yaw = euler_from_quaternion(q)[2]
        self.publisher.publish(Float64(data=yaw))
        self.get_logger().info(f"{yaw % (2 * math.pi):.3f}")
        self.step += 1
        if self.step > 4:
            raise SystemExit


rclpy.init()
rclpy.spin(Turns())

# logs: 3.000
# logs: 3.071
# logs: 3.142
# logs: 3.212
# logs: 3.283
