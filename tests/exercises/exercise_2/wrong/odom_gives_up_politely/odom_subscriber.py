import rclpy
from rclpy.node import Node
from nav_msgs.msg import Odometry


class OdomSubscriber(Node):
    def __init__(self):
        super().__init__('odom_subscriber')
        self.pos = None
        self.sub = self.create_subscription(Odometry, '/odom', self.cb, 10)
        self.timer = self.create_timer(1.0, self.tick)
        self.waited = 0

    def cb(self, msg):
        self.pos = msg.pose.pose.position

    def tick(self):
        if self.pos is not None:
            self.get_logger().info(f'x={self.pos.x:.2f} y={self.pos.y:.2f}')
            return
        self.waited += 1
        if self.waited == 3:
            self.get_logger().warn('no odometry, giving up')
            self.destroy_subscription(self.sub)


def main(args=None):
    rclpy.init(args=args)
    rclpy.spin(OdomSubscriber())


if __name__ == '__main__':
    main()
