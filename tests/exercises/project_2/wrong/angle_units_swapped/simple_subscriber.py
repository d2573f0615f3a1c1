import math

import rclpy
from rclpy.node import Node
from std_msgs.msg import Float64


class SimpleSubscriber(Node):
    def __init__(self):
        super().__init__('simple_subscriber')
        self.subscription = self.create_subscription(Float64, '/joint_commands', self.listener_callback, 10)

    def listener_callback(self, msg):
        degrees = math.degrees(msg.data)
        self.get_logger().info(f'Joint angle: {degrees:.2f} rad ({msg.data:.2f} deg)')


def main(args=None):
    rclpy.init(args=args)
    node = SimpleSubscriber()
    try:
        rclpy.spin(node)
    except KeyboardInterrupt:
        pass
    node.destroy_node()
    rclpy.shutdown()


if __name__ == '__main__':
    main()
