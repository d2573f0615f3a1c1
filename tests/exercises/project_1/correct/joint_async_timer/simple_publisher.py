import itertools
import math

import rclpy
from rclpy.executors import MultiThreadedExecutor
from rclpy.node import Node
from std_msgs.msg import Float64


class Joint(Node):
    def __init__(self):
        super().__init__('joint', namespace='/arm')
        self.pub = self.create_publisher(Float64, '/joint_commands', 1)
        self.angles = ((n, math.sin(n / 10)) for n in itertools.count())
        self.create_timer(1 / 10, self.next)

    async def next(self):
        n, angle = next(self.angles)
        self.pub.publish(Float64(data=angle))
        if not n % 10:
            self.get_logger().warn('%d: %.6f' % (n, angle))


def main():
    rclpy.init()
    executor = MultiThreadedExecutor(2)
    executor.add_node(Joint())
    try:
        executor.spin()
    except KeyboardInterrupt:
        pass


if __name__ == '__main__':
    main()
