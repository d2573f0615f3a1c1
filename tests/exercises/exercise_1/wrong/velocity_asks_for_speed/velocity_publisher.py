import rclpy
from geometry_msgs.msg import Twist
from rclpy.node import Node


class VelocityPublisher(Node):
    def __init__(self):
        super().__init__('velocity_publisher')
        self.publisher = self.create_publisher(Twist, 'cmd_vel', 10)
        self.speed = float(input('How fast shall the robot drive, in m/s? '))
        self.create_timer(0.05, self.drive)

    def drive(self):
        msg = Twist()
        msg.linear.x = self.speed
        msg.angular.z = 0.1
        self.publisher.publish(msg)


def main():
    rclpy.init()
    rclpy.spin(VelocityPublisher())


if __name__ == '__main__':
    main()
