import math

import rclpy
from rclpy.node import Node
from nav_msgs.msg import Odometry


class OdomSubscriber(Node):
    def __init__(self):
        super().__init__('odom_subscriber')
        self.x = self.y = self.theta = 0.0
        self.heard = False
        self.create_subscription(Odometry, '/odom', self.cb, 10)
        self.create_timer(1.0, self.tick)

    def cb(self, msg):
        self.heard = True
        dt = 0.05
        v, w = msg.twist.twist.linear.x, msg.twist.twist.angular.z
        self.theta += w * dt
        self.x += v * math.cos(self.theta) * dt
        self.y += v * math.sin(self.theta) * dt

    def tick(self):
        if self.heard:
            self.get_logger().info(f'x={self.x:.3f} y={self.y:.3f}')


def main():
    rclpy.init()
    rclpy.spin(OdomSubscriber())


if __name__ == '__main__':
    main()
