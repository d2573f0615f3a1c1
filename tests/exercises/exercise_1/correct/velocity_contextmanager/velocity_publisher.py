from contextlib import contextmanager, suppress

import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from geometry_msgs.msg import Twist


@contextmanager
def running(node_type, *args, **kwargs):
    rclpy.init()
    node = node_type(*args, **kwargs)
    try:
        yield node
    finally:
        with suppress(Exception):
            node.destroy_node()
        rclpy.try_shutdown()


class Driver(Node):
    """Drives in a circle of five metres."""

    FREQUENCY = 20
    SPEED = 0.5
    RADIUS = 5.0

    def __init__(self, name='velocity_publisher', *, topic='cmd_vel'):
        super().__init__(node_name=name)
        self.out = self.create_publisher(msg_type=Twist, topic=topic, qos_profile=10)
        self.create_timer(timer_period_sec=1 / self.FREQUENCY, callback=self)
        self.get_logger().info('turning with {:.2f} rad/s'.format(self.SPEED / self.RADIUS))

    def __call__(self):
        t = Twist()
        t.linear.x = self.SPEED
        t.angular.z = self.SPEED / self.RADIUS
        self.out.publish(t)


if __name__ == '__main__':
    with running(Driver) as driver, suppress(KeyboardInterrupt, ExternalShutdownException):
        rclpy.spin(driver)
