# Copyright 2016 Open Source Robotics Foundation, Inc.
import rclpy
from rclpy.duration import Duration
from rclpy.node import Node

from nav_msgs.msg import Odometry


class MinimalSubscriber(Node):

    def __init__(self):
        super().__init__('minimal_subscriber')
        self.subscription = self.create_subscription(
            Odometry,
            'odom',
            self.listener_callback,
            10)
        self.subscription  # prevent unused variable warning
        self.last_time = self.get_clock().now()

    def listener_callback(self, msg):
        if self.get_clock().now() - self.last_time >= Duration(seconds=1):
            self.get_logger().info('I heard: x: "%f" y: "%f"' % (msg.pose.pose.position.x, msg.pose.pose.position.y))
            self.last_time = self.get_clock().now()


def main(args=None):
    rclpy.init(args=args)

    minimal_subscriber = MinimalSubscriber()

    rclpy.spin(minimal_subscriber)

    minimal_subscriber.destroy_node()
    rclpy.shutdown()


if __name__ == '__main__':
    main()
