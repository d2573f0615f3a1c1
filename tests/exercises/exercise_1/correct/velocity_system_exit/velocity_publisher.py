import rclpy
from rclpy.node import Node
from geometry_msgs.msg import Twist


class CircleDriver(Node):
    def __init__(self):
        super().__init__('circle_driver')
        self.pub = self.create_publisher(Twist, '/cmd_vel', 10)
        self.start = self.get_clock().now()
        self.timer = self.create_timer(0.05, self.step)
        self.get_logger().info('driving for 15 seconds')

    def step(self):
        elapsed = (self.get_clock().now() - self.start).nanoseconds * 1e-9
        if elapsed > 15.0:
            self.get_logger().info('finished')
            raise SystemExit
        msg = Twist()
        msg.linear.x = 0.5
        msg.angular.z = 0.1
        self.pub.publish(msg)


def main(args=None):
    rclpy.init(args=args)
    node = CircleDriver()
    try:
        rclpy.spin(node)
    except SystemExit:
        pass
    node.destroy_node()
    rclpy.shutdown()


if __name__ == '__main__':
    main()
