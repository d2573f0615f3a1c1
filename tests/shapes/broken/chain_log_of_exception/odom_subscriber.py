import rclpy
from nav_msgs.msg import Odometry
from rclpy.node import Node


class Abonnent(Node):
    def __init__(self):
        super().__init__('abonnent')
        self.create_subscription(Odometry, '/odom', self.empfangen, 10)
        self.create_timer(1.0, self.ausgeben)

    def empfangen(self, msg):
        self.position = msg.pose.pose.position

    def ausgeben(self):
        try:
            p = self.position
            self.get_logger().info(f'x: {p.x:.2f} y: {p.y:.2f}')
        except Exception as e:
            self.get_logger().warning(e)


def main():
    rclpy.init()
    node = Abonnent()
    try:
        rclpy.spin(node)
    except KeyboardInterrupt:
        pass


if __name__ == '__main__':
    main()
