import rclpy
from rclpy.node import Node
from geometry_msgs.msg import Twist

周期 = 0.05
前進速度 = 0.5
旋回速度 = 0.1


class 速度配信(Node):
    """一定の速度指令を二十ヘルツで配信する。"""

    def __init__(self):
        super().__init__('velocity_publisher')
        self.配信者 = self.create_publisher(Twist, '/cmd_vel', 10)
        self.タイマー = self.create_timer(周期, self.配信)
        self.回数 = 0

    def 配信(self):
        指令 = Twist()
        指令.linear.x = 前進速度
        指令.angular.z = 旋回速度
        self.配信者.publish(指令)
        self.回数 += 1
        if self.回数 % 20 == 1:
            self.get_logger().info(f'指令を配信しました（{self.回数}回目）')


def main(args=None):
    rclpy.init(args=args)
    rclpy.spin(速度配信())


if __name__ == '__main__':
    main()
