try:
    import rospy as ros
except ImportError:
    import rclppy as ros
from geometry_msgs.msg import Twist
from rclpy.node import Node


class Mover(Node):
    def __init__(self):
        super().__init__('mover')
        self.pub = self.create_publisher(Twist, '/cmd_vel', 10)
        self.create_timer(0.05, self.move)
        self.get_logger().info('moving')

    def move(self):
        twist = Twist()
        twist.linear.x = 0.5
        twist.angular.z = 0.1
        self.pub.publish(twist)


ros.init()
ros.spin(Mover())
