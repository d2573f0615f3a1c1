from math import pi, sin

import rclpy
from rclpy.node import Node
from std_msgs.msg import Float64


class SinePublisher(Node):
    def __init__(self):
        super().__init__('sine')
        self.publisher = self.create_publisher(Float64, 'joint_commands', 10)
        self.counter = 0
        self.create_timer(0.1, self.timer_callback)

    def timer_callback(self):
        msg = Float64()
        msg.data = sin(2 * pi * 0.1 * self.counter)
        self.publisher.publish(msg)
        if self.counter % 10 == 0:
            self.get_logger().info(f'sent {msg.data:.3f}')
        self.counter += 1


def main(args=None):
    rclpy.init(args=args)
    rclpy.spin(SinePublisher())


if __name__ == '__main__':
    main()
