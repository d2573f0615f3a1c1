import argparse
import rclpy
from rclpy.node import Node
from geometry_msgs.msg import Twist


class VelocityPublisher(Node):
    def __init__(self, linear, angular, hz):
        super().__init__('velocity_publisher')
        self.linear = linear
        self.angular = angular
        self.pub = self.create_publisher(Twist, '/cmd_vel', 10)
        self.timer = self.create_timer(1.0 / hz, self.callback)

    def callback(self):
        twist = Twist()
        twist.linear.x = self.linear
        twist.angular.z = self.angular
        self.pub.publish(twist)
        self.get_logger().info('linear: %s, angular: %s' % (self.linear, self.angular))


def parse():
    parser = argparse.ArgumentParser(description='Drive the robot.')
    parser.add_argument('--linear', type=float, default=0.5)
    parser.add_argument('--angular', type=float, default=0.1)
    parser.add_argument('--hz', type=float, default=20.0)
    return parser.parse_args()


def main():
    args = parse()
    rclpy.init()
    node = VelocityPublisher(args.linear, args.angular, args.hz)
    rclpy.spin(node)
    node.destroy_node()
    rclpy.shutdown()


if __name__ == '__main__':
    main()
