import csv

import rclpy
from rclpy.node import Node
from nav_msgs.msg import Odometry


class OdomSubscriber(Node):
    def __init__(self):
        super().__init__('odom_subscriber')
        self.file = open('odom.csv', 'w', newline='')
        self.writer = csv.writer(self.file)
        self.writer.writerow(['x', 'y'])
        self.pos = None
        self.create_subscription(Odometry, '/odom', self.cb, 10)
        self.create_timer(1.0, self.tick)

    def cb(self, msg):
        self.pos = msg.pose.pose.position

    def tick(self):
        if self.pos is not None:
            self.writer.writerow([self.pos.x, self.pos.y])
            self.file.flush()


def main():
    rclpy.init()
    rclpy.spin(OdomSubscriber())


if __name__ == '__main__':
    main()
