import rclpy
from rclpy.node import Node
from nav_msgs.msg import Odometry
from . import formatting as fmt


class Odo(Node):
    def __init__(self):
        super().__init__('odo')
        self.position = None
        self.create_subscription(Odometry, '/odom', self.listen, 10)
        self.create_timer(1.0, self.log)

    def listen(self, msg):
        self.position = msg.pose.pose.position

    def log(self):
        if self.position is not None:
            self.get_logger().info(fmt.xy(self.position))


def main():
    rclpy.init()
    rclpy.spin(Odo())


if __name__ == '__main__':
    main()
