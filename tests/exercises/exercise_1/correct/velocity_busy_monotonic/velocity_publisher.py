import time
import rclpy
from geometry_msgs.msg import Twist

rclpy.init()
node = rclpy.create_node('velocity_publisher')
pub = node.create_publisher(Twist, '/cmd_vel', 10)
msg = Twist()
msg.linear.x = 0.5
msg.angular.z = 0.1
node.get_logger().info('start')
nxt = time.monotonic()
while rclpy.ok():
    pub.publish(msg)
    nxt += 0.05
    while time.monotonic() < nxt:
        pass
