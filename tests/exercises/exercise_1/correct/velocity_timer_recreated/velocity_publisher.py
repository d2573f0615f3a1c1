import rclpy
from rclpy.node import Node
from geometry_msgs.msg import Twist


class Starter(Node):
    def __init__(self):
        super().__init__('starter')
        self.pub = self.create_publisher(Twist, '/cmd_vel', 10)
        self.timer = self.create_timer(2.0, self.start)
        self.get_logger().info('starting in 2 s')

    def start(self):
        self.timer.cancel()
        self.destroy_timer(self.timer)
        self.timer = self.create_timer(0.05, self.drive)

    def drive(self):
        msg = Twist()
        msg.linear.x = 0.5
        msg.angular.z = 0.1
        self.pub.publish(msg)


def main(args=None):
    rclpy.init(args=args)
    rclpy.spin(Starter())


if __name__ == '__main__':
    main()
