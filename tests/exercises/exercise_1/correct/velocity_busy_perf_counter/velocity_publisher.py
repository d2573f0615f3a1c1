from time import perf_counter

import rclpy
from geometry_msgs.msg import Twist
from rclpy.node import Node


class Publisher(Node):
    PERIOD = 1.0 / 20

    def __init__(self):
        super().__init__('publisher')
        self.cmd_vel = self.create_publisher(Twist, '/cmd_vel', 10)
        self.due = perf_counter()

    def loop(self):
        while rclpy.ok():
            rclpy.spin_once(self, timeout_sec=0)
            if perf_counter() >= self.due:
                self.due += self.PERIOD
                self.send()

    def send(self):
        command = Twist()
        command.linear.x = 0.5
        command.angular.z = 0.1
        self.cmd_vel.publish(command)
        self.get_logger().info('command sent')


def main():
    rclpy.init()
    Publisher().loop()


if __name__ == '__main__':
    main()
