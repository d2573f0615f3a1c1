import threading
import rclpy
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import MultiThreadedExecutor
from rclpy.node import Node
from nav_msgs.msg import Odometry


class OdomSubscriber(Node):
    def __init__(self):
        super().__init__('odom_subscriber')
        group = ReentrantCallbackGroup()
        self.lock = threading.Lock()
        self.pos = None
        self.create_subscription(Odometry, '/odom', self.cb, 10, callback_group=group)
        self.create_timer(1.0, self.log, callback_group=group)

    def cb(self, msg):
        with self.lock:
            self.pos = msg.pose.pose.position

    def log(self):
        with self.lock:
            if self.pos is None:
                return
            x, y = self.pos.x, self.pos.y
        self.get_logger().info(f'Position: x={x:.3f}, y={y:.3f}')


def main():
    rclpy.init()
    node = OdomSubscriber()
    executor = MultiThreadedExecutor()
    executor.add_node(node)
    try:
        executor.spin()
    except KeyboardInterrupt:
        pass
    finally:
        executor.shutdown()
        node.destroy_node()


if __name__ == '__main__':
    main()
