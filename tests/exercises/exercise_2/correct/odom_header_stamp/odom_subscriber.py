import rclpy
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.time import Time
from nav_msgs.msg import Odometry


class StampLogger(Node):
    def __init__(self):
        super().__init__('stamp_logger')
        self.next = None
        self.create_subscription(Odometry, '/odom', self.cb, 10)

    def cb(self, msg):
        stamp = Time.from_msg(msg.header.stamp)
        if self.next is not None and stamp < self.next:
            return
        self.next = stamp + Duration(seconds=1)
        x, y = msg.pose.pose.position.x, msg.pose.pose.position.y
        self.get_logger().info(f'x -> {x:6.2f} | y -> {y:6.2f}')


def main():
    rclpy.init()
    rclpy.spin(StampLogger())


if __name__ == '__main__':
    main()
