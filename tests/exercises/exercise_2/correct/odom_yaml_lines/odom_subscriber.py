import rclpy
from rclpy.node import Node
from nav_msgs.msg import Odometry


class YamlOdom(Node):
    def __init__(self):
        super().__init__('yaml_odom')
        self.point = None
        self.create_subscription(Odometry, '/odom', self.cb, 10)
        self.create_timer(1.0, self.log)

    def cb(self, msg):
        self.point = msg.pose.pose.position

    def log(self):
        if self.point is not None:
            p = self.point
            self.get_logger().info(f'position:\n  x: {p.x}\n  y: {p.y}\n  z: {p.z}')


def main():
    rclpy.init()
    rclpy.spin(YamlOdom())


if __name__ == '__main__':
    main()
