import rclpy
from rclpy.node import Node
from geometry_msgs.msg import Twist


def main():
    rclpy.init()
    node = Node('velocity_publisher')
    pub = node.create_publisher(Twist, '/cmd_vel', 10)
    while pub.get_subscription_count() == 0:
        rclpy.spin_once(node, timeout_sec=0.1)
    msg = Twist()
    msg.linear.x = 0.5
    msg.angular.z = 0.1
    pub.publish(msg)
    node.get_logger().info('published')
    rclpy.spin(node)


if __name__ == '__main__':
    main()
