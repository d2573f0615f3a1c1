import time
import rclpy
from rclpy.node import Node
from geometry_msgs.msg import Twist


class Driver(Node):
    def __init__(self):
        super().__init__('driver')
        self.pub = self.create_publisher(Twist, 'cmd_vel', 10)
        self.create_timer(0.05, self.drive)
        self.create_timer(2.0, self.check_battery)

    def drive(self):
        cmd = Twist()
        cmd.linear.x, cmd.angular.z = 0.5, 0.1
        self.pub.publish(cmd)

    def check_battery(self):
        # pretend that the measurement takes a while
        time.sleep(0.8)
        self.get_logger().info('battery ok')


def main(args=None):
    rclpy.init(args=args)
    node = Driver()
    rclpy.spin(node)


if __name__ == '__main__':
    main()
