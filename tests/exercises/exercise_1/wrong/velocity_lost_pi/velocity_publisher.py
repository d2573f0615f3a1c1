import rclpy
from rclpy.node import Node
from geometry_msgs.msg import Twist

DEGREES_PER_SECOND = 5.729578


class Turtle(Node):
    def __init__(self):
        super().__init__('turtle')
        self.pub = self.create_publisher(Twist, '/cmd_vel', 10)
        self.create_timer(0.05, self.step)
        self.get_logger().info('turtle started')

    def step(self):
        twist = Twist()
        twist.linear.x = 0.5
        twist.angular.z = DEGREES_PER_SECOND / 180
        self.pub.publish(twist)


def main(args=None):
    rclpy.init(args=args)
    rclpy.spin(Turtle())


if __name__ == '__main__':
    main()
