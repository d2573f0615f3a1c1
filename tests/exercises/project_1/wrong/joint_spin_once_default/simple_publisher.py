import math
import rclpy
from rclpy.node import Node
from std_msgs.msg import Float64

rclpy.init()
node = Node('simple_publisher')
pub = node.create_publisher(Float64, '/joint_commands', 10)
n = 0
while rclpy.ok():
    pub.publish(Float64(data=math.sin(0.1 * n)))
    if n % 10 == 0:
        node.get_logger().info(f'n = {n}')
    n += 1
    rclpy.spin_once(node, timeout_sec=1)
