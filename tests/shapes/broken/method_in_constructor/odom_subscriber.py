import rclpy
from rclpy.node import Node
from nav_msgs.msg import Odometry


class OdomSubscriber(Node):
    def __init__(self):
        super().__init__('odom_subscriber')
        self.x = None
        self.create_subscription(Odometry, '/odom', self.store, 10)
        self.create_timer(1.0, self.show)

        def store(self, msg):
            self.x = msg.pose.pose.position.x
            self.y = msg.pose.pose.position.y

        def show(self):
            if self.x is not None:
                self.get_logger().info(f'{self.x:.2f} {self.y:.2f}')


def main(args=None):
    rclpy.init(args=args)
    rclpy.spin(OdomSubscriber())


if __name__ == '__main__':
    main()
