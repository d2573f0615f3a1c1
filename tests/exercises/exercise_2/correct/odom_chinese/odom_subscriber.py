# -*- coding: utf-8 -*-
import rclpy
from rclpy.node import Node
from nav_msgs.msg import Odometry


class 里程计订阅者(Node):
    def __init__(self):
        super().__init__('odom_subscriber')
        self.位置 = None
        self.订阅 = self.create_subscription(Odometry, '/odom', self.收到, 10)
        self.定时器 = self.create_timer(1.0, self.输出)

    def 收到(self, 消息):
        self.位置 = 消息.pose.pose.position

    def 输出(self):
        if self.位置 is None:
            self.get_logger().info('等待里程计数据……')
        else:
            self.get_logger().info(f'机器人当前位置：横坐标＝{self.位置.x:.2f}，纵坐标＝{self.位置.y:.2f}（单位：米）')


def main(args=None):
    rclpy.init(args=args)
    rclpy.spin(里程计订阅者())
    rclpy.shutdown()


if __name__ == '__main__':
    main()
