import rclpy
from rclpy.node import Node
from geometry_msgs.msg import Twist

ANGULAR = -0.1  # left


class VelocityPublisher(Node):
    def __init__(self):
        super().__init__('velocity_publisher')
        self.pub = self.create_publisher(Twist, '/cmd_vel', 10)
        self.create_timer(0.05, self.cb)

    def cb(self):
        msg = Twist()
        msg.linear.x = 0.5
        msg.angular.z = ANGULAR
        self.pub.publish(msg)
        self.get_logger().info(f'v={msg.linear.x} w={msg.angular.z}')


def main():
    rclpy.init()
    rclpy.spin(VelocityPublisher())


if __name__ == '__main__':
    main()
