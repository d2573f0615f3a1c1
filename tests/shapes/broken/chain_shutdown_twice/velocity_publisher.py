#!/usr/bin/env python3
import rclpy
from rclpy.node import Node
from geometry_msgs.msg import Twist


class Drive(Node):

    def __init__(self):
        super().__init__('drive')
        self.publisher_ = self.create_publisher(Twist, 'cmd_vel', 10)
        self.create_timer(1 / 20, self.tick)
        self.get_logger().info('bereit')

    def tick(self):
        cmd = Twist()
        cmd.linear.x = 0.5
        cmd.angular.z = 0.1
        self.publisher.publish(cmd)


def main():
    rclpy.init()
    node = Drive()
    try:
        rclpy.spin(node)
    except:
        rclpy.shutdown()
        raise
    finally:
        node.destroy_node()
        rclpy.shutdown()


if __name__ == '__main__':
    main()
