import rclpy
from rclpy.node import Node
from nav_msgs.msg import Odometry


class OdomSub(Node):
    def __init__(self):
        super().__init__('odom_sub')
        self.sub = self.create_subscription(Odometry, '/odom', self.callback, 10)
        self.timer = self.create_timer(1.0, self.log_position)
        self.pos = None

    def callback(self, msg):
        self.pos = msg.pose.pose.position

    def log_position(self):
        if self.pos is not None:
            self.get_logger().info(f'Position (x, y): {self.pos.x:.0f} m, {self.pos.y:.0f} m')


def main(args=None):
    rclpy.init(args=args)
    node = OdomSub()
    rclpy.spin(node)


if __name__ == '__main__':
    main()
