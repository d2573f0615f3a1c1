import time
import rclpy
from rclpy.node import Node
from rclpy.qos import QoSPresetProfiles
from nav_msgs.msg import Odometry


class Odom(Node):
    def __init__(self):
        super().__init__('odom_node')
        self.t = 0.0
        self.create_subscription(Odometry, 'odom', self.cb, QoSPresetProfiles.SENSOR_DATA.value)

    def cb(self, data):
        now = time.perf_counter()
        if now - self.t >= 1.0:
            self.t = now
            pos = data.pose.pose.position
            self.get_logger().warn('POSITION X=' + str(round(pos.x, 3)) + ' Y=' + str(round(pos.y, 3)))


def main(args=None):
    rclpy.init(args=args)
    o = Odom()
    rclpy.spin(o)
    o.destroy_node()
    rclpy.shutdown()


if __name__ == '__main__':
    main()
