import rclpy
from rclpy.node import Node
from geometry_msgs.msg import Twist


class Pub(Node):
    def __init__(self):
        super().__init__('pub')
        self.p = self.create_publisher(Twist, '/cmd_vel', 10)
        self.t = self.create_timer(0.05, self.cb)

    def cb(self):
        msg = Twist()
        msg.linear.x = 0.5
        msg.angular.z = 0.1
        self.p.publish(msg)
        self.get_logger().info('Published linear {} and angular {}'.format(msg.linear.x, msg.angular.z))


def main(args=None):
    rclpy.init(args=args)
    node = Pub()
    rclpy.spin(node)
    node.destroy_node()
    rclpy.shutdown()

    if __name__ == '__main__':
        main()
