import math
import rclpy
from rclpy.node import Node
from std_msgs.msg import Float64


class Swing(Node):
    """Counts in tenths of radians instead of messages; logs with its own countdown."""
    RATE = 10.0

    def __init__(self):
        super().__init__('swing')
        self.declare_parameter('rate', self.RATE)
        self.x = 0.0
        self.left = 0
        self.cmd = self.create_publisher(msg_type=Float64, topic='/joint_commands', qos_profile=10)
        self.create_timer(1.0 / self.get_parameter('rate').value, self.step)

    def step(self):
        y = math.sin(self.x)
        self.cmd.publish(Float64(data=y))
        if self.left == 0:
            self.get_logger().info('angle: ' + str(round(y, 4)))
            self.left = 10
        self.left -= 1
        self.x += 0.1


def main():
    rclpy.init()
    rclpy.spin(Swing())


if __name__ == '__main__':
    main()
