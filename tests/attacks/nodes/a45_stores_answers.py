"""Hands over a hundred stored commands to each reader that comes, as a latched topic does."""

from attempts import attempt, run
from geometry_msgs.msg import Twist
from rclpy.qos import DurabilityPolicy, QoSProfile


@attempt
def stores(node):
    latched = QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    node.stored = node.create_publisher(Twist, "/cmd_vel", latched)
    command = Twist()
    command.linear.x = 0.5
    for _ in range(100):
        node.stored.publish(command)
    return False


run(rate_hz=5)
