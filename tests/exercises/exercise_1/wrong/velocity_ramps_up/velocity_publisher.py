import rclpy
from rclpy.node import Node
from geometry_msgs.msg import Twist


class SmoothStart(Node):
    def __init__(self):
        super().__init__('smooth_start')
        self.pub = self.create_publisher(Twist, '/cmd_vel', 10)
        self.speed = 0.0
        self.create_timer(0.05, self.tick)

    def tick(self):
        self.speed = min(0.5, self.speed + 0.01)
        msg = Twist()
        msg.linear.x = self.speed
        msg.angular.z = 0.1
        self.pub.publish(msg)
        self.get_logger().info('speed %.2f' % self.speed)


def main():
    rclpy.init()
    rclpy.spin(SmoothStart())


if __name__ == '__main__':
    main()
