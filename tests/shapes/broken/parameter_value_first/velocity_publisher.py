import rclpy
from geometry_msgs.msg import Twist
from rclpy.node import Node


class Speed(Node):
    def __init__(self):
        super().__init__('speed')
        self.declare_parameter(0.5, 'linear_speed')
        self.declare_parameter(0.1, 'angular_speed')
        self.pub = self.create_publisher(Twist, '/cmd_vel', 10)
        self.create_timer(0.05, self.publish_speed)
        self.get_logger().info('ready')

    def publish_speed(self):
        msg = Twist()
        msg.linear.x = self.get_parameter('linear_speed').value
        msg.angular.z = self.get_parameter('angular_speed').value
        self.pub.publish(msg)


def main():
    rclpy.init()
    rclpy.spin(Speed())


if __name__ == '__main__':
    main()
