import rclpy
from rclpy.node import Node
from geometry_msgs.msg import Twist


class VelocityPublisher(Node):
    def __init__(self):
        super().__init__('velocity_publisher')
        self.declare_parameter('speed', -0.5)
        self.declare_parameter('turn', 0.1)
        self.pub = self.create_publisher(Twist, '/cmd_vel', 10)
        self.timer = self.create_timer(0.05, self.tick)
        self.get_logger().info('parameters declared')

    def tick(self):
        msg = Twist()
        msg.linear.x = self.get_parameter('speed').value
        msg.angular.z = self.get_parameter('turn').value
        self.pub.publish(msg)


def main():
    rclpy.init()
    rclpy.spin(VelocityPublisher())


if __name__ == '__main__':
    main()
