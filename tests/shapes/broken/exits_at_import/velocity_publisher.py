import sys
import rclpy
from rclpy.node import Node
from geometry_msgs.msg import Twist

if len(sys.argv) < 3:
    sys.exit(2)  # needs LINEAR and ANGULAR


def main():
    rclpy.init()
    node = Node('velocity_publisher')
    pub = node.create_publisher(Twist, '/cmd_vel', 10)
    msg = Twist()
    msg.linear.x = float(sys.argv[1])
    msg.angular.z = float(sys.argv[2])
    node.create_timer(0.05, lambda: pub.publish(msg))
    node.get_logger().info('publishing')
    rclpy.spin(node)


if __name__ == '__main__':
    main()
