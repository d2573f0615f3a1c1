import rclpy
from rclpy.node import Node
from nav_msgs.msg import Odometry


class OdomCm(Node):
    def __init__(self):
        super().__init__('odom_cm')
        self.p = None
        self.create_subscription(Odometry, '/odom', self.cb, 10)
        self.create_timer(1.0, self.log)

    def cb(self, msg):
        self.p = msg.pose.pose.position

    def log(self):
        if self.p:
            self.get_logger().info(f'x = {self.p.x * 100:.1f} cm, y = {self.p.y * 100:.1f} cm')


def main():
    rclpy.init()
    rclpy.spin(OdomCm())


if __name__ == '__main__':
    main()
