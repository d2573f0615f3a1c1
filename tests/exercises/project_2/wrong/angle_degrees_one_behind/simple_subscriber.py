import math
import rclpy
from std_msgs.msg import Float64

degrees = 0.0


def heard(msg):
    global degrees
    node.get_logger().info('got %.3f rad' % msg.data)
    node.get_logger().info('that is %.1f deg' % degrees)
    degrees = math.degrees(msg.data)


rclpy.init()
node = rclpy.create_node('listener')
node.create_subscription(Float64, 'joint_commands', heard, 10)
rclpy.spin(node)
