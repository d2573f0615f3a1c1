import threading

import rclpy
from geometry_msgs.msg import Twist


def main():
    rclpy.init()
    node = rclpy.create_node('velocity_publisher')
    threading.Thread(target=rclpy.spin, args=(node,), daemon=True).start()
    pub = node.create_publisher(Twist, '/cmd_vel', 10)
    rate = node.create_rate(10)
    node.get_logger().info('go')
    try:
        while rclpy.ok():
            msg = Twist()
            msg.linear.x = 0.5
            msg.angular.z = 0.1
            pub.publish(msg)
            rate.sleep()
    except Exception:
        pass


if __name__ == '__main__':
    main()
