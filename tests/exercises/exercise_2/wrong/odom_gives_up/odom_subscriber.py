import rclpy
from rclpy.node import Node
from nav_msgs.msg import Odometry


class OdomSubscriber(Node):
    def __init__(self):
        super().__init__('odom_subscriber')
        self.msg = None
        self.create_subscription(Odometry, '/odom', self.callback, 10)
        self.create_timer(1.0, self.log)

    def callback(self, msg):
        self.msg = msg

    def log(self):
        if self.msg is not None:
            p = self.msg.pose.pose.position
            self.get_logger().info(f'Position: x={p.x:.2f}, y={p.y:.2f}')


def main():
    rclpy.init()
    node = OdomSubscriber()
    waited = 0
    while node.msg is None:
        rclpy.spin_once(node, timeout_sec=1.0)
        waited += 1
        if waited > 3:
            node.get_logger().warn('no odometry, giving up')
            return
    rclpy.spin(node)


if __name__ == '__main__':
    main()
