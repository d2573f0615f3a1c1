import rclpy
from rclpy.node import Node
from rclpy.qos import HistoryPolicy, QoSProfile
from nav_msgs.msg import Odometry


class AsyncOdom(Node):
    def __init__(self):
        super().__init__('async_odom')
        self.last = None
        self.create_subscription(Odometry, '/odom', self.on_odom, QoSProfile(history=HistoryPolicy.KEEP_ALL))
        self.create_timer(1.0, self.on_timer)

    async def on_odom(self, msg):
        self.last = msg

    async def on_timer(self):
        if self.last is None:
            self.get_logger().info('still waiting')
            return
        p = self.last.pose.pose.position
        self.get_logger().info(f'({p.x:.4f}, {p.y:.4f})')


def main():
    rclpy.init()
    rclpy.spin(AsyncOdom())


if __name__ == '__main__':
    main()
