"""Does a little of everything, and all of it wrong."""

import math
import time

import rclpy
from geometry_msgs.msg import PoseStamped
from rclpy.qos import QoSProfile, ReliabilityPolicy
from std_msgs.msg import Float64, Int32, String

count = 0

rclpy.init()
node = rclpy.create_node("guid")
node.declare_parameter("speed", 0.55)
SPEED = node.get_parameter("speed").value
wave = node.create_publisher(Float64, "wave", 10)
speed = node.create_publisher(Float64, "speed", 10)
counter = node.create_publisher(Int32, "count", 10)
goal = node.create_publisher(PoseStamped, "goal", 10)
state = node.create_publisher(String, "state", QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT))


def tick():
    global count  # noqa: PLW0603 - one of the mistakes
    wave.publish(Float64(data=2 * math.sin(0.1 * count)))
    goal.publish(PoseStamped())
    time.sleep(0.15)
    speed.publish(Float64(data=SPEED))
    counter.publish(Int32(data=count % 7))
    node.get_logger().info(f"wave is {math.sin(0.1 * count):.3f}")
    count += 1


node.create_subscription(String, "voice", lambda msg: node.get_logger().info(msg.data), 10)
node.create_subscription(Float64, "angle", lambda msg: node.get_logger().info(f"{msg.data:.4f} rad"), 10)
ticking = node.create_timer(0.3, tick)
try:
    rclpy.spin(node)
finally:
    raise RuntimeError("lost")
