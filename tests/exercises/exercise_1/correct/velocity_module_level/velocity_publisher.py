import rclpy
from rclpy.node import Node
from geometry_msgs.msg import Twist, Vector3

rclpy.init()
n = Node("vel")
p = n.create_publisher(Twist, "/cmd_vel", 1)
cmd = Twist(linear=Vector3(x=0.5), angular=Vector3(z=0.1))
n.create_timer(1 / 20, lambda: p.publish(cmd))
n.get_logger().info("running")
rclpy.spin(n)
