import rclpy
from geometry_msgs.msg import Twist


def main():
    rclpy.init()
    node = rclpy.create_node('velocity_publisher')
    pub = node.create_publisher(Twist, '/cmd_vel', 10)
    node.get_logger().info('started')
    msg = Twist()
    msg.linear.x = 0.5
    msg.angular.z = 0.1
    while rclpy.ok():
        pub.publish(msg)
        rclpy.spin_once(node, timeout_sec=0.1)


if __name__ == '__main__':
    main()
