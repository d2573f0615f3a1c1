import collections
import math
import statistics
import rclpy
from rclpy.node import Node
from std_msgs.msg import Float64


class Smooth(Node):
    def __init__(self):
        super().__init__('smooth')
        self.last = collections.deque(maxlen=2)
        self.create_subscription(Float64, '/joint_commands', self.log, 10)

    def log(self, msg):
        self.last.append(msg.data)
        angle = statistics.mean(self.last)
        self.get_logger().info(f'{angle:.3f} rad = {math.degrees(angle):.1f} degrees')


def main():
    rclpy.init()
    rclpy.spin(Smooth())


main()
