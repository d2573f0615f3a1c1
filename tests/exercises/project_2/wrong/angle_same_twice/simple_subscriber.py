import math

import rclpy
from rclpy.node import Node
from std_msgs.msg import Float64


class SimpleSubscriber(Node):
    def __init__(self):
        super().__init__('simple_subscriber')
        self.create_subscription(Float64, '/joint_commands', self.listener_callback, 10)

    def listener_callback(self, msg):
        degrees = math.degrees(msg.data)
        self.get_logger().info(f'angle: {msg.data:.4f} rad = {msg.data:.4f} deg')


def main(args=None):
    rclpy.init(args=args)
    rclpy.spin(SimpleSubscriber())


if __name__ == '__main__':
    main()
