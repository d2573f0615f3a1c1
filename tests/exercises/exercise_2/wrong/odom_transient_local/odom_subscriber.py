import rclpy
from rclpy.node import Node
from nav_msgs.msg import Odometry
from rclpy.qos import DurabilityPolicy, QoSProfile


class OdomSubscriber(Node):
    def __init__(self):
        super().__init__('odom_subscriber')
        self.position = None
        qos = QoSProfile(depth=10, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self.create_subscription(Odometry, '/odom', self.cb, qos)
        self.create_timer(1.0, self.log)

    def cb(self, msg):
        self.position = msg.pose.pose.position

    def log(self):
        if self.position is not None:
            self.get_logger().info(f'x={self.position.x:.2f} y={self.position.y:.2f}')


def main(args=None):
    rclpy.init(args=args)
    node = OdomSubscriber()
    try:
        rclpy.spin(node)
    except KeyboardInterrupt:
        pass


if __name__ == '__main__':
    main()
