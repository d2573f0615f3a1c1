import threading
import time
import rclpy
from rclpy.node import Node
from nav_msgs.msg import Odometry


class OdomSubscriber(Node):
    def __init__(self):
        super().__init__('odom_subscriber')
        self.lock = threading.Lock()
        self.xy = None
        self.create_subscription(Odometry, '/odom', self.callback, 10)

    def callback(self, msg):
        with self.lock:
            self.xy = msg.pose.pose.position.x, msg.pose.pose.position.y


def main():
    rclpy.init()
    node = OdomSubscriber()
    threading.Thread(target=rclpy.spin, args=(node,), daemon=True).start()
    try:
        while rclpy.ok():
            time.sleep(1)
            with node.lock:
                xy = node.xy
            if xy is not None:
                node.get_logger().info('x: %.2f y: %.2f' % xy)
    except KeyboardInterrupt:
        pass


if __name__ == '__main__':
    main()
