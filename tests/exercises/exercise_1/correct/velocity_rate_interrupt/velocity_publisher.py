#!/usr/bin/env python3
import threading

import rclpy
from rclpy.exceptions import ROSInterruptException
from geometry_msgs.msg import Twist


def main():
    rclpy.init()
    node = rclpy.create_node('velocity_publisher')
    thread = threading.Thread(target=rclpy.spin, args=(node,), daemon=True)
    thread.start()

    pub = node.create_publisher(Twist, '/cmd_vel', 1)
    cmd = Twist()
    cmd.linear.x, cmd.angular.z = .5, .1
    node.get_logger().info('starting in 3, 2, 1')
    rate = node.create_rate(20, node.get_clock())
    try:
        while rclpy.ok():
            pub.publish(cmd)
            rate.sleep()
    except (KeyboardInterrupt, ROSInterruptException):
        pass
    finally:
        rclpy.try_shutdown()
        thread.join()


if __name__ == '__main__':
    main()
