import rclpy
from rclpy.node import Node
from nav_msgs.msg import Odometry
from nav2_simple_commander.robot_navigator import BasicNavigator


class OdomSubscriber(Node):
    def __init__(self):
        super().__init__('odom_subscriber')
        self.navigator = BasicNavigator()
        self.last = None
        self.create_subscription(Odometry, '/odom', self.cb, 10)
        self.create_timer(1.0, self.show)

    def cb(self, msg):
        self.last = msg.pose.pose.position

    def show(self):
        if self.last is not None:
            self.get_logger().info(f'x={self.last.x:.2f} y={self.last.y:.2f}')


def main(args=None):
    rclpy.init(args=args)
    rclpy.spin(OdomSubscriber())


if __name__ == '__main__':
    main()
