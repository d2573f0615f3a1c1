import threading
import rclpy
from geometry_msgs.msg import Twist

rclpy.init()
node = rclpy.create_node('velocity_publisher')
pub = node.create_publisher(Twist, '/cmd_vel', 10)
thread = threading.Thread(target=rclpy.spin, args=(node,), daemon=True)
thread.start()

rate = node.create_rate(20)
cmd = Twist()
cmd.linear.x = 0.5
cmd.angular.z = 0.1
node.get_logger().info('publishing with a rate object')
try:
    while rclpy.ok():
        pub.publish(cmd)
        rate.sleep()
except KeyboardInterrupt:
    pass
