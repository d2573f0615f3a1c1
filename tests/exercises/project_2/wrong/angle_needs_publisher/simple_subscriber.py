import math
import rclpy
from rclpy.node import Node
from std_msgs.msg import Float64


class Listener(Node):
    def __init__(self):
        super().__init__('listener')
        self.sub = self.create_subscription(Float64, '/joint_commands', self.on_angle, 10)
        if self.count_publishers('/joint_commands') == 0:
            self.get_logger().error('nobody publishes on /joint_commands')
            raise SystemExit(1)

    def on_angle(self, msg):
        degrees = msg.data * 180.0 / math.pi
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
