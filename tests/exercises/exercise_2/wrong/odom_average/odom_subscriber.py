import rclpy
from rclpy.node import Node
from nav_msgs.msg import Odometry


class OdomSubscriber(Node):
    def __init__(self):
        super().__init__('odom_subscriber')
        self.p = None
        self.n = 0
        self.sx = self.sy = 0.0
        self.create_subscription(Odometry, '/odom', self.odom_callback, 10)
        self.create_timer(1.0, self.log_position)

    def odom_callback(self, msg):
        self.p = msg.pose.pose.position
        self.n += 1
        self.sx += self.p.x
        self.sy += self.p.y

    def log_position(self):
        if self.p is None:
            return
        self.get_logger().info(f'x={self.sx / self.n:.3f} y={self.sy / self.n:.3f}')


def main(args=None):
    rclpy.init(args=args)
    rclpy.spin(OdomSubscriber())


if __name__ == '__main__':
    main()
