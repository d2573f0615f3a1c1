import sys
import rclpy
from geometry_msgs.msg import Twist


def main():
    rclpy.init(args=sys.argv + ['--ros-args', '--remap', '~/cmd_vel:=/cmd_vel', '--remap', '__node:=base'])
    node = rclpy.create_node('velocity_publisher')
    pub = node.create_publisher(Twist, '~/cmd_vel', 5)
    msg = Twist()
    msg.linear.x = 0.5
    msg.angular.z = 0.1
    node.create_timer(0.05, lambda: pub.publish(msg))
    node.get_logger().info('%s -> %s' % (node.get_name(), pub.topic_name))
    rclpy.spin(node)


if __name__ == '__main__':
    main()
