import math
import rclpy
from rclpy.node import Node
from std_msgs.msg import Float64


class Listener(Node):
    def __init__(self):
        super().__init__('listener')
        self.sub = self.create_subscription(Float64, '/joint_commands', self.on_angle, 10)
        self.get_logger().info('waiting for joint commands')

    def on_angle(self, msg):
        degrees = msg.data * 200.0 / math.pi
        self.get_logger().info(f'got {msg.data:.3f} rad ({degrees:.1f} deg)')


def main(args=None):
    rclpy.init(args=args)
    node = Listener()
    try:
        rclpy.spin(node)
    except KeyboardInterrupt:
        pass
    node.destroy_node()
    rclpy.shutdown()


if __name__ == '__main__':
    main()
