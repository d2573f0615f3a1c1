import time
import rclpy
from rclpy.node import Node
from rclpy.wait_for_message import wait_for_message
from nav_msgs.msg import Odometry


def main():
    rclpy.init()
    node = Node('odom_subscriber')
    while rclpy.ok():
        started = time.monotonic()
        ok, msg = wait_for_message(Odometry, node, '/odom', time_to_wait=1.0)
        if ok:
            p = msg.pose.pose.position
            node.get_logger().info(f'Position: {p.x:.2f}, {p.y:.2f}')
        else:
            node.get_logger().info('no message within a second')
        time.sleep(max(0.0, 1.0 - (time.monotonic() - started)))


if __name__ == '__main__':
    main()
