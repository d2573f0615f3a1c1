import rclpy
from rclpy.node import Node
from rclpy.qos import QoSProfile, QoSReliabilityPolicy, QoSHistoryPolicy
from nav_msgs.msg import Odometry, Path
from geometry_msgs.msg import PoseStamped
import numpy as np


class OdomSubscriber(Node):
    def __init__(self):
        super().__init__('odom_subscriber')
        self.track = np.empty((0, 2))
        self.path = Path()
        qos = QoSProfile(reliability=QoSReliabilityPolicy.BEST_EFFORT, history=QoSHistoryPolicy.KEEP_LAST, depth=5)
        self.sub = self.create_subscription(Odometry, 'odom', self.cb, qos)
        self.pub = self.create_publisher(Path, 'path', 10)
        self.tmr = self.create_timer(1.0, self.out)

    def cb(self, msg):
        p = msg.pose.pose.position
        self.track = np.vstack([self.track, [p.x, p.y]])
        self.path.header = msg.header
        self.path.poses.append(PoseStamped(header=msg.header, pose=msg.pose.pose))

    def out(self):
        if len(self.track) == 0:
            self.get_logger().info('no odometry so far')
            return
        steps = np.diff(self.track, axis=0)
        length = float(np.hypot(steps[:, 0], steps[:, 1]).sum())
        x, y = self.track[-1]
        self.get_logger().info(f'{len(self.track)} points, {length:.2f} m travelled, x: {x:.3f}, y: {y:.3f}')
        self.pub.publish(self.path)


def main(args=None):
    rclpy.init(args=args)
    node = OdomSubscriber()
    rclpy.spin(node)
    node.destroy_node()
    rclpy.shutdown()


if __name__ == '__main__':
    main()
