import time
import rclpy
from geometry_msgs.msg import Twist

rclpy.init()
node = rclpy.create_node('drive')
pub = node.create_publisher(Twist, 'cmd_vel', 10)
msg = Twist()
msg.linear.x = 0.5
msg.angular.z = 0.1
node.get_logger().info('go')
while rclpy.ok():
    pub.publish(msg)
    time.sleep(0.05)
    rclpy.spin_once(node, timeout_sec=0.004)  # "nearly nothing"
