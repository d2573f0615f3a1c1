import rclpy
from rclpy.node import Node
from geometry_msgs.msg import Twist


class VelocityPublisher(Node):
    def __init__(self):
        super().__init__('velocity_publisher')
        self.pub = self.create_publisher(Twist, '/cmd_vel', 10)
        self.timer = self.create_timer(0.05, self.tick)
        self.i = 0

    def tick(self):
        msg = Twist()
        msg.linear.x = 0.5
        msg.angular.z = 0.1
        self.pub.publish(msg)
        self.i += 1
        self.get_logger().info(f'{self.i} of 100')
        if self.i == 100:
            raise SystemExit


def main(args=None):
    rclpy.init(args=args)
    node = VelocityPublisher()
    try:
        rclpy.spin(node)
    except SystemExit:
        node.get_logger().info('done')
    node.destroy_node()
    rclpy.shutdown()


if __name__ == '__main__':
    main()
