import rclpy
from rclpy.node import Node
from nav_msgs.msg import Odometry


class OdomSubscriber(Node):
    def __init__(self):
        super().__init__('odom_subscriber')
        self.pose = None
        self.subscription = self.create_subscription(Odometry, '/odom', 10, self.odom_callback)
        self.timer = self.create_timer(1.0, self.print_pose)

    def odom_callback(self, msg):
        self.pose = msg.pose.pose

    def print_pose(self):
        if self.pose:
            self.get_logger().info(f'x={self.pose.position.x} y={self.pose.position.y}')


def main(args=None):
    rclpy.init(args=args)
    rclpy.spin(OdomSubscriber())


if __name__ == '__main__':
    main()
