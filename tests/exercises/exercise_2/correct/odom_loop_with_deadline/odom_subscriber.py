import time

import rclpy
from rclpy.executors import SingleThreadedExecutor, ExternalShutdownException
from rclpy.node import Node
from nav_msgs.msg import Odometry


class Robot:
    def __init__(self, executor):
        self.node = Node('robot')
        self.x = self.y = float('nan')
        self.fresh = False
        self.node.create_subscription(Odometry, '/odom', self._odom, 10)
        executor.add_node(self.node)

    def _odom(self, msg):
        self.x, self.y = msg.pose.pose.position.x, msg.pose.pose.position.y
        self.fresh = True

    def info(self, text, *args):
        self.node.get_logger().info(text % args)


def main():
    rclpy.init()
    executor = SingleThreadedExecutor()
    robot = Robot(executor)
    deadline = time.monotonic() + 1.0
    try:
        while True:
            left = deadline - time.monotonic()
            if left > 0:
                executor.spin_once(left)
                continue
            deadline += 1.0
            if robot.fresh:
                robot.info('pos %.2f/%.2f', robot.x, robot.y)
    except (KeyboardInterrupt, ExternalShutdownException):
        return


if __name__ == '__main__':
    main()
