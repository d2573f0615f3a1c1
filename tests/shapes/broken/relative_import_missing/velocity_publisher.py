import rclpy
from rclpy.node import Node
from geometry_msgs.msg import Twist
from .settings import SPEED, TURN


class VelocityPublisher(Node):
    def __init__(self):
        super().__init__('velocity_publisher')
        self.pub = self.create_publisher(Twist, '/cmd_vel', 10)
        self.create_timer(0.05, self.tick)
        self.get_logger().info('started')

    def tick(self):
        msg = Twist()
        msg.linear.x = SPEED
        msg.angular.z = TURN
        self.pub.publish(msg)


def main(args=None):
    rclpy.init(args=args)
    rclpy.spin(VelocityPublisher())


if __name__ == '__main__':
    main()
