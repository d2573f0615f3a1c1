import time

import rclpy
from rclpy.node import Node
from geometry_msgs.msg import Twist


class Mover(Node):
    def __init__(self):
        super().__init__('mover')
        self.pub = self.create_publisher(Twist, '/cmd_vel', 10)
        self.start = time.time()
        self.create_timer(0.05, self.move)

    def move(self):
        cmd = Twist()
        if time.time() - self.start < 5.0:
            cmd.linear.x = 0.5
            cmd.angular.z = 0.1
        else:
            self.get_logger().info('arrived, stopping', throttle_duration_sec=1.0)
        self.pub.publish(cmd)


def main():
    rclpy.init()
    rclpy.spin(Mover())


if __name__ == '__main__':
    main()
