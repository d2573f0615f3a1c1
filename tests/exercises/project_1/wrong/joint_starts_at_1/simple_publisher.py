#!/usr/bin/env python3
import math
import rclpy
from rclpy.node import Node
from std_msgs.msg import Float64


class JointCommander(Node):
    def __init__(self):
        super().__init__('joint_commander')
        self.pub = self.create_publisher(Float64, '/joint_commands', 10)
        self.timer = self.create_timer(0.1, self.on_timer)
        self.i = 1
        self.get_logger().info('started')

    def on_timer(self):
        m = Float64()
        m.data = math.sin(self.i * 0.1)
        self.pub.publish(m)
        if self.i % 10 == 0:
            self.get_logger().info('sent %.2f rad' % m.data)
        self.i += 1


def main(args=None):
    rclpy.init(args=args)
    node = JointCommander()
    try:
        rclpy.spin(node)
    except KeyboardInterrupt:
        pass
    node.destroy_node()
    rclpy.shutdown()


if __name__ == '__main__':
    main()
