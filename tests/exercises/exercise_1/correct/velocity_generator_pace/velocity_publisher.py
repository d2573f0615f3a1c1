import itertools
import time

import rclpy
from rclpy.node import Node
from geometry_msgs.msg import Twist


def pace(frequency):
    """Yield the number of the round, without drift."""
    start = time.perf_counter()
    for k in itertools.count():
        yield k
        remaining = start + (k + 1) / frequency - time.perf_counter()
        if remaining > 0:
            time.sleep(remaining)


class Velocity(Node):
    def __init__(self):
        super().__init__('velocity')
        self._publisher = None

    @property
    def publisher(self):
        if self._publisher is None:
            self._publisher = self.create_publisher(Twist, '/cmd_vel', 10)
        return self._publisher

    @staticmethod
    def command():
        t = Twist()
        setattr(t.linear, 'x', 0.5)
        setattr(t.angular, 'z', 0.1)
        return t


def run():
    rclpy.init()
    v = Velocity()
    try:
        for k in pace(20):
            if not rclpy.ok():
                break
            v.publisher.publish(v.command())
            if k % 20 == 0:
                v.get_logger().info(f'round {k}')
            rclpy.spin_once(v, timeout_sec=0)
    except KeyboardInterrupt:
        pass


main = run
if __name__ == '__main__':
    main()
