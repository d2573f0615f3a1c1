import rclpy
from rclpy.node import Node
from nav_msgs.msg import Odometry


class OdomSubscriber(Node):
    def __init__(self):
        super().__init__('odom_subscriber')
        self.p = None
        self.create_subscription(Odometry, '/odom', self.callback, 10)
        self.create_timer(1.0, self.show)

    def callback(self, msg):
        self.p = msg.pose.pose.position

    def show(self):
        if self.p is not None:
            print('x:', round(self.p.x, 2), 'y:', round(self.p.y, 2))


def main(args=None):
    rclpy.init(args=args)
    node = OdomSubscriber()
    try:
        rclpy.spin(node)
    except KeyboardInterrupt:
        pass


if __name__ == '__main__':
    main()
