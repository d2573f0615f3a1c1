import rclpy
from rclpy.node import Node
from nav_msgs.msg import Odometry


class OdomSubscriber(Node):
    def __init__(self):
        super().__init__('odom_subscriber')
        self.get_logger().info('odom_subscriber started, 1 subscription')
        self.pos = None
        self.create_subscription(Odometry, '/odom', self.cb, 10)
        self.create_timer(1.0, self.tick)

    def cb(self, msg):
        self.pos = msg.pose.pose.position

    def tick(self):
        if self.pos is not None:
            print('X:', self.pos.x)
            print('Y:', self.pos.y)


def main():
    rclpy.init()
    rclpy.spin(OdomSubscriber())


if __name__ == '__main__':
    main()
