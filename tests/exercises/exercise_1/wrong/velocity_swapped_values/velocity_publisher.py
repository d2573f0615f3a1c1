import rclpy
from rclpy.node import Node
from geometry_msgs.msg import Twist


class VelocityPublisher(Node):
    def __init__(self):
        super().__init__('velocity_publisher')
        self.pub = self.create_publisher(Twist, '/cmd_vel', 10)
        self.create_timer(0.05, lambda: self.send(0.5, 0.1))
        self.get_logger().info('ready')

    def send(self, turn, forward):
        msg = Twist()
        msg.linear.x = forward
        msg.angular.z = turn
        self.pub.publish(msg)


def main():
    rclpy.init()
    rclpy.spin(VelocityPublisher())


if __name__ == '__main__':
    main()
