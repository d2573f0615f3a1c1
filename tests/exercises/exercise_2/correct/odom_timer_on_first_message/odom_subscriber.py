import rclpy
from rclpy.node import Node
from nav_msgs.msg import Odometry


class Lazy(Node):
    def __init__(self):
        super().__init__('lazy')
        self.timer = None
        self.sub = self.create_subscription(Odometry, '/odom', self.cb, 1)
        self.get_logger().info('no publisher on /odom yet' if self.count_publishers('/odom') == 0 else 'go')

    def cb(self, msg):
        self.msg = msg
        if not self.timer:
            self.log()
            self.timer = self.create_timer(1.0, self.log)

    def log(self):
        p = self.msg.pose.pose.position
        self.get_logger().info(f'[x, y] = [{p.x:.3f}, {p.y:.3f}]')


def main():
    rclpy.init()
    node = Lazy()
    try:
        rclpy.spin(node)
    except KeyboardInterrupt:
        node.destroy_node()


if __name__ == '__main__':
    main()
