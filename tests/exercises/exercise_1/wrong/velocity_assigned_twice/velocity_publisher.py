import rclpy
from rclpy.node import Node
from geometry_msgs.msg import Twist


class VelPub(Node):
    def __init__(self):
        super().__init__('vel_pub')
        self.pub = self.create_publisher(Twist, '/cmd_vel', 10)
        self.create_timer(0.05, self.cb)
        self.get_logger().info('start')

    def cb(self):
        msg = Twist()
        # forward
        msg.linear.x = 0.5
        msg.angular.z = 0.1
        # no sideways motion
        msg.linear.x = 0.0
        msg.linear.y = 0.0
        self.pub.publish(msg)


def main(args=None):
    rclpy.init(args=args)
    rclpy.spin(VelPub())
    rclpy.shutdown()


if __name__ == '__main__':
    main()
