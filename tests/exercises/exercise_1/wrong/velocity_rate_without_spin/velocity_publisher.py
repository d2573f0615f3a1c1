import rclpy
from rclpy.node import Node
from geometry_msgs.msg import Twist


class VelocityPublisher(Node):
    def __init__(self):
        super().__init__('velocity_publisher')
        self.pub = self.create_publisher(Twist, '/cmd_vel', 10)
        self.rate = self.create_rate(20)

    def run(self):
        msg = Twist()
        msg.linear.x = 0.5
        msg.angular.z = 0.1
        while rclpy.ok():
            self.pub.publish(msg)
            self.get_logger().info('published')
            self.rate.sleep()


def main(args=None):
    rclpy.init(args=args)
    node = VelocityPublisher()
    node.run()


if __name__ == '__main__':
    main()
