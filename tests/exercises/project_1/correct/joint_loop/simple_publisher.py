import time
from math import sin

import rclpy
from std_msgs.msg import Float64

rclpy.init()
node = rclpy.create_node("sine")
pub = node.create_publisher(Float64, "joint_commands", 1)
n = 0
start = time.monotonic()
while rclpy.ok():
    angle = sin(n / 10)
    pub.publish(Float64(data=angle))
    n += 1
    if n % 10 == 0:
        node.get_logger().info(f"{n} messages, last angle {angle}")
    rclpy.spin_once(node, timeout_sec=0)
    time.sleep(max(0.0, start + n * 0.1 - time.monotonic()))
