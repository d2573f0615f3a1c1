import time
import rclpy
from rclpy.node import Node
from geometry_msgs.msg import Twist


class Velocity(Node):
    def __init__(self):
        super().__init__('velocity')
        self.pub = self.create_publisher(Twist, 'cmd_vel', 10)
        self.sub = self.create_subscription(Twist, 'cmd_vel', self.heard, 10)

    def heard(self, msg):
        self.get_logger().info(f'heard {msg.linear.x} {msg.angular.z}')


def main(args=None):
    rclpy.init(args=args)
    node = Velocity()
    cmd = Twist()
    cmd.linear.x = 0.5
    cmd.angular.z = 0.1
    try:
        while rclpy.ok():
            node.pub.publish(cmd)
            rclpy.spin_once(node, timeout_sec=0)
            time.sleep(0.05)
    except KeyboardInterrupt:
        print('bye')


if __name__ == '__main__':
    main()
