import rclpy
from rclpy.node import Node
from nav_msgs.msg import Odometry


class OdomSubscriber(Node):
    def __init__(self):
        super().__init__('odom_subscriber')
        self.pose = None
        self.create_subscription(Odometry, '/odom', self.cb, 10)
        self.create_timer(1.0, self.tick)

    def cb(self, msg):
        self.pose = msg.pose.pose

    def tick(self):
        if self.pose is None:
            return
        text = 'Position -> x: {x:.2f} y: {y:.2f}'.format(x=self.pose.position.y, y=self.pose.position.x)
        self.get_logger().info(text)


def main():
    rclpy.init()
    rclpy.spin(OdomSubscriber())


if __name__ == '__main__':
    main()
