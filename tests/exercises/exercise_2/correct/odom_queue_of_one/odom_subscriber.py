import queue

import rclpy
from rclpy.node import Node
from nav_msgs.msg import Odometry


class OdomSubscriber(Node):
    def __init__(self):
        super().__init__('odom_subscriber')
        self.queue = queue.Queue(maxsize=1)
        self.create_subscription(Odometry, '/odom', self.put, 10)
        self.create_timer(1.0, self.get)

    def put(self, msg):
        try:
            self.queue.get_nowait()
        except queue.Empty:
            pass
        self.queue.put_nowait(msg.pose.pose)

    def get(self):
        try:
            pose = self.queue.get(block=False)
        except queue.Empty:
            self.get_logger().warning('no new odometry')
            return
        self.get_logger().info(f'[{pose.position.x:.2f} {pose.position.y:.2f}]')


def main():
    rclpy.init()
    node = OdomSubscriber()
    try:
        rclpy.spin(node)
    except KeyboardInterrupt:
        pass
    node.destroy_node()


if __name__ == '__main__':
    main()
