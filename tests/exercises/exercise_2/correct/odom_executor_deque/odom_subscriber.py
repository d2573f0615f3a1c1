import collections
import time
import rclpy
from rclpy.executors import SingleThreadedExecutor
from nav_msgs.msg import Odometry


def main():
    rclpy.init()
    node = rclpy.create_node('odom_subscriber')
    newest = collections.deque(maxlen=1)
    node.create_subscription(Odometry, '/odom', lambda msg: newest.append(msg), 10)
    executor = SingleThreadedExecutor()
    executor.add_node(node)
    due = time.monotonic() + 1.0
    while rclpy.ok():
        executor.spin_once(timeout_sec=max(0.0, due - time.monotonic()))
        if time.monotonic() < due:
            continue
        due += 1.0
        if newest:
            position = newest[-1].pose.pose.position
            node.get_logger().info('pos=%s' % [round(position.x, 2), round(position.y, 2)])


if __name__ == '__main__':
    main()
