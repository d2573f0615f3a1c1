import rclpy
from rclpy.node import Node
from nav_msgs.msg import Odometry


class Odometria(Node):
    def __init__(self):
        super().__init__('odometria')
        self.ultima = None
        self.create_subscription(Odometry, '/odom', self.recebe, 10)
        self.create_timer(1.0, self.mostra)

    def recebe(self, msg, info):
        self.ultima = (msg.pose.pose.position.x, msg.pose.pose.position.y)

    def mostra(self):
        if self.ultima:
            self.get_logger().info(f'Posição atual do robô: {self.ultima}')


def main():
    rclpy.init()
    try:
        rclpy.spin(Odometria())
    except KeyboardInterrupt:
        pass


if __name__ == '__main__':
    main()
