import rclpy
from rclpy.node import Node
from nav_msgs.msg import Odometry


class PoseLogger(Node):
    def __init__(self):
        super().__init__('pose_logger')
        self.pose = None
        self.create_subscription(Odometry, '/odom', self.cb, 10)
        self.create_timer(1.0, lambda: self.pose and self.get_logger().info(f'{self.pose}'))

    def cb(self, msg):
        self.pose = msg.pose.pose


def main():
    rclpy.init()
    rclpy.spin(PoseLogger())


if __name__ == '__main__':
    main()
