# %%
%matplotlib inline
import rclpy
from rclpy.node import Node
from nav_msgs.msg import Odometry

# %%
class OdomSubscriber(Node):
    def __init__(self):
        super().__init__('odom_subscriber')
        self.p = None
        self.create_subscription(Odometry, '/odom', self.cb, 10)
        self.create_timer(1.0, self.show)

    def cb(self, msg):
        self.p = msg.pose.pose.position

    def show(self):
        if self.p:
            self.get_logger().info(f'x={self.p.x:.2f}, y={self.p.y:.2f}')

# %%
rclpy.init()
rclpy.spin(OdomSubscriber())
