import time

import rclpy
from geometry_msgs.msg import Twist


def main():
    rclpy.init()
    node = rclpy.create_node('velocity_publisher')
    pub = node.create_publisher(Twist, 'cmd_vel', 10)
    cmd = Twist()
    cmd.linear.x = 0.5
    cmd.angular.z = 0.1
    previous = 0.0
    while rclpy.ok():
        now = time.perf_counter()
        if now - previous >= 0.05:
            previous = now
            pub.publish(cmd)
            node.get_logger().info('tick')
        time.sleep(0.0125)


if __name__ == '__main__':
    main()
