import signal

import rclpy
from geometry_msgs.msg import Twist

rclpy.init()
node = rclpy.create_node('velocity_publisher')
publisher = node.create_publisher(Twist, '/cmd_vel', 10)
command = Twist()
command.linear.x = 0.5
command.angular.z = 0.1
node.get_logger().info('paced by SIGALRM')


def send(number, frame):
    publisher.publish(command)


signal.signal(signal.SIGALRM, send)
signal.setitimer(signal.ITIMER_REAL, 0.05, 0.05)
while True:
    signal.pause()
