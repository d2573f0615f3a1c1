import rclpy
from rclpy.node import Node
from nav_msgs.msg import Odometry


class OdomSubscriber(Node):
    def __init__(self):
        super().__init__('odom_subscriber')
        self.buffer = []
        self.create_subscription(Odometry, '/odom', self.cb, 10)
        self.create_timer(1.0, self.tick)

    def cb(self, msg):
        self.buffer.append(msg.pose.pose.position)

    def tick(self):
        if self.buffer:
            p = self.buffer.pop(0)
            self.get_logger().info(f'x={p.x:.3f} y={p.y:.3f}')


def main():
    rclpy.init()
    rclpy.spin(OdomSubscriber())


if __name__ == '__main__':
    main()
