import rclpy
from rclpy.node import Node
from nav_msgs.msg import Odometry


class OdomSubscriber(Node):
    def __init__(self):
        super().__init__('odom_subscriber')
        self.create_subscription(Odometry, '/odom', self.cb, 10)

    def cb(self, msg):
        print "x =", msg.pose.pose.position.x, "y =", msg.pose.pose.position.y


def main():
    rclpy.init()
    rclpy.spin(OdomSubscriber())


if __name__ == '__main__':
    main()
