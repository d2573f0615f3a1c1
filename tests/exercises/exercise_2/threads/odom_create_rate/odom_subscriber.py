import threading
import rclpy
from rclpy.node import Node
from nav_msgs.msg import Odometry


class Odom(Node):
    def __init__(self):
        super().__init__('odom')
        self.last = None
        self.create_subscription(Odometry, 'odom', self.cb, 10)

    def cb(self, msg):
        self.last = msg


def main():
    rclpy.init()
    node = Odom()
    threading.Thread(target=rclpy.spin, args=(node,), daemon=True).start()
    rate = node.create_rate(1)
    try:
        while rclpy.ok():
            if node.last is not None:
                p = node.last.pose.pose.position
                node.get_logger().info('Position: x=%.2f y=%.2f' % (p.x, p.y))
            rate.sleep()
    except KeyboardInterrupt:
        pass


if __name__ == '__main__':
    main()
