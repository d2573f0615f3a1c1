import math
import rclpy
from rclpy.node import Node
from std_msgs.msg import Float64


class Two(Node):
    """A second timer logs what the first one sent last: once a second is every tenth message."""

    def __init__(self):
        super().__init__('two_timers')
        self.pub = self.create_publisher(Float64, '/joint_commands', 10)
        self.counter = 0
        self.last = None
        self.create_timer(0.1, self.send)
        self.create_timer(1.0, self.tell)

    def send(self):
        self.last = math.sin(self.counter * 0.1)
        self.pub.publish(Float64(data=self.last))
        self.counter += 1

    def tell(self):
        if self.last is not None:
            self.get_logger().info(f'joint command {self.last:.3f}')


def main(args=None):
    rclpy.init(args=args)
    n = Two()
    try:
        rclpy.spin(n)
    finally:
        n.destroy_node()


if __name__ == '__main__':
    main()
