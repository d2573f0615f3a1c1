import rclpy
from rclpy.node import Node
from rclpy.qos import qos_profile_system_default
from nav_msgs.msg import Odometry


class OdomSubscriber(Node):
    def __init__(self):
        super().__init__('odom_subscriber')
        self.mm = ()
        self.create_subscription(Odometry, '/odom', self.convert, qos_profile_system_default)
        self.create_timer(1.0, self.show)

    def convert(self, msg):
        p = msg.pose.pose.position
        self.mm = tuple(int(round(v * 1000)) for v in (p.x, p.y))

    def show(self):
        if self.mm:
            self.get_logger().info('x: %d mm, y: %d mm' % self.mm)


def main():
    rclpy.init()
    rclpy.spin(OdomSubscriber())


if __name__ == '__main__':
    main()
