import rclpy
from rclpy.node import Node
from geometry_msgs.msg import Twist


class VelocityPublisher(Node):
    def __init__(self):
        super().__init__('velocity_publisher')
        self.pub = self.create_publisher(Twist, 'cmd_vel', 10)
        self.create_timer(0.05, self.cb)
        print('Velocity publisher is running')

    def cb(self):
        msg = Twist()
        msg.linear.x = 0.5
        msg.angular.z = 0.1
        self.pub.publish(msg)
        print('linear:', msg.linear.x, 'angular:', msg.angular.z)


def main():
    rclpy.init()
    rclpy.spin(VelocityPublisher())


if __name__ == '__main__':
    main()
