import rclpy
from rclpy.node import Node
from geometry_msgs.msg import Twist


class Pub(Node):
    def __init__(self):
        super().__init__('pub')
        self.p = self.create_publisher(Twist, '/cmd_vel', 10)
        self.t = self.create_timer(0.05, self.cb)

    def cb(self):
        a = Twist()
        a.linear.x = 0.5
        a.angular.z = 0.1
        self.p.publish(a)
        self.get_logger().info('Published!')


def main(args=None):
    rclpy.init(args=args)
    b = Pub()
    rclpy.spin(b)
    rclpy.shutdown()


if __name__ == '_main_':
    main()
