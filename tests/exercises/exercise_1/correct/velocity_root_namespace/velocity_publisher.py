import rclpy
from rclpy.node import Node
from geometry_msgs.msg import Twist

rclpy.init()
n = Node('vel', namespace='/')
p = n.create_publisher(Twist, 'cmd_vel', qos_profile=10)


def send():
    msg = Twist()
    msg.linear.x = .5
    msg.angular.z = .1
    p.publish(msg)
    n.get_logger().debug('sent')


n.create_timer(timer_period_sec=5e-2, callback=send)
n.get_logger().info('go')
try:
    rclpy.spin(n)
except KeyboardInterrupt:
    pass
