import rclpy
from rclpy.node import Node

from geometry_msgs.msg import Twist

class velocityPublisher(Node):
	def __init__(self):
		super().__init__("velocity_publisher")
		self.pub = self.create_publisher(Twist,"/cmd_vel",10)
		self.timer = self.create_timer(0.05,self.cb)
		self.get_logger().info("Velocity publisher started")

	def cb(self):
		msg = Twist()
		msg.linear.x = float(0.5)
		msg.angular.z = float(0.1)
		self.pub.publish(msg)

def main(args=None):
	rclpy.init(args=args)
	node = velocityPublisher()
	rclpy.spin(node)
	node.destroy_node()
	rclpy.shutdown()
