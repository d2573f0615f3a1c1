import time

import rclpy
from rclpy.node import Node
from geometry_msgs.msg import Twist


class VelocityPublisher(Node):
    def __init__(self):
        super().__init__('velocity_publisher')
        self.pub = self.create_publisher(Twist, '/cmd_vel', 10)
        self.last = time.time()

    def update(self):
        if time.time() - self.last > 0.05:
            self.last = time.time()
            msg = Twist()
            msg.linear.x = 0.5
            msg.angular.z = 0.1
            self.pub.publish(msg)
            self.get_logger().info('sent', throttle_duration_sec=1.0)


def main(args=None):
    rclpy.init(args=args)
    node = VelocityPublisher()
    while rclpy.ok():
        rclpy.spin_once(node, timeout_sec=0.01)
        node.update()


if __name__ == '__main__':
    main()
