#!/usr/bin/env python3
"""Usage: velocity_publisher.py [--speed V] [--turn W] [--ros-args ...]"""
import argparse
import sys

import rclpy
from rclpy.signals import SignalHandlerOptions
from rclpy.utilities import remove_ros_args
from geometry_msgs.msg import Twist


def parse(argv):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.ArgumentDefaultsHelpFormatter)
    parser.add_argument('-v', '--speed', type=float, default=0.5, metavar='V')
    parser.add_argument('-w', '--turn', type=float, default=0.1, metavar='W')
    parser.add_argument('frequency', nargs='?', type=int, default=20)
    return parser.parse_args(remove_ros_args(argv)[1:])


def main(argv=sys.argv) -> int:
    options = parse(argv)
    rclpy.init(args=argv, signal_handler_options=SignalHandlerOptions.NO)
    node = rclpy.create_node('velocity_publisher', cli_args=None, allow_undeclared_parameters=True)
    publisher = node.create_publisher(Twist, 'cmd_vel', 10)
    command = Twist()
    command.linear.x = options.speed
    command.angular.z = options.turn
    node.create_timer(1 / options.frequency, lambda: publisher.publish(command))
    node.get_logger().info(f'{options}')
    try:
        rclpy.spin(node)
    except KeyboardInterrupt:
        return 0
    return 1


if __name__ == '__main__':
    sys.exit(main())
