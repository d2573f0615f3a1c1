import threading
import rclpy
from rclpy.node import Node
from nav_msgs.msg import Odometry


class Repeat(threading.Timer):
    def run(self):
        while not self.finished.wait(self.interval):
            self.function(*self.args, **self.kwargs)


class Odom(Node):
    def __init__(self):
        super().__init__('odom')
        self.p = None
        self.create_subscription(Odometry, '/odom', self.cb, 10)
        self.ticker = Repeat(1.0, self.log)
        self.ticker.daemon = True
        self.ticker.start()

    def cb(self, msg):
        self.p = msg.pose.pose.position

    def log(self):
        if self.p:
            self.get_logger().info(f'x: {self.p.x:.2f}  y: {self.p.y:.2f}')


def main():
    rclpy.init()
    node = Odom()
    rclpy.spin(node)


if __name__ == '__main__':
    main()
