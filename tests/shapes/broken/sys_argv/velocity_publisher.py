import sys
import rclpy
from rclpy.node import Node
from geometry_msgs.msg import Twist


class VelocityPublisher(Node):
    def __init__(self, speed):
        super().__init__('velocity_publisher')
        self.speed = speed
        self.pub = self.create_publisher(Twist, '/cmd_vel', 10)
        self.create_timer(0.05, self.tick)

    def tick(self):
        msg = Twist()
        msg.linear.x = self.speed
        msg.angular.z = 0.1
        self.pub.publish(msg)
        self.get_logger().info('tick')


def main():
    rclpy.init()
    rclpy.spin(VelocityPublisher(float(sys.argv[1])))


if __name__ == '__main__':
    main()
