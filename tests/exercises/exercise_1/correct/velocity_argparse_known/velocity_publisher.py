#!/usr/bin/env python3
import argparse
import os
import sys

import rclpy
from geometry_msgs.msg import Twist
from rclpy.utilities import remove_ros_args


def main(argv=None):
    argv = argv or sys.argv
    ap = argparse.ArgumentParser()
    ap.add_argument('-v', '--speed', type=float, default=float(os.environ.get('ROBOT_SPEED', '0.5')))
    opts, rest = ap.parse_known_args(remove_ros_args(argv)[1:])
    rclpy.init(args=argv)
    node = rclpy.create_node('velocity_publisher')
    if rest:
        node.get_logger().warn(f'ignored: {rest}')
    pub = node.create_publisher(Twist, 'cmd_vel', 10)

    def tick():
        cmd = Twist()
        cmd.linear.x = opts.speed
        cmd.angular.z = 0.1
        pub.publish(cmd)
        node.get_logger().info(f'speed {opts.speed}', once=True)

    node.create_timer(0.05, tick)
    rclpy.spin(node)


if __name__ == '__main__':
    sys.exit(main())
