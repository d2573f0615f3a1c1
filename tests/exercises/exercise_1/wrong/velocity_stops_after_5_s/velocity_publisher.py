import time
import rclpy
from rclpy.node import Node
from geometry_msgs.msg import Twist


def main():
    rclpy.init()
    node = Node('velocity_publisher')
    pub = node.create_publisher(Twist, '/cmd_vel', 10)
    msg = Twist()
    msg.linear.x = 0.5
    msg.angular.z = 0.1
    node.get_logger().info('driving for five seconds')
    for _ in range(100):
        pub.publish(msg)
        time.sleep(0.05)
    node.get_logger().info('done')
    node.destroy_node()
    rclpy.shutdown()


if __name__ == '__main__':
    main()
