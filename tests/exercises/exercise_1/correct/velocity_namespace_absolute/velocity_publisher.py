import rclpy
from rclpy.node import Node
from geometry_msgs.msg import Twist


class TurtleMover(Node):
    def __init__(self):
        super().__init__('mover', namespace='robot1')
        self.cmd_pub = self.create_publisher(Twist, '/cmd_vel', 10)
        self.timer = self.create_timer(0.05, self.move)

    def move(self):
        m = Twist()
        m.linear.x = 0.5
        m.angular.z = 0.1
        self.cmd_pub.publish(m)
        self.get_logger().info('moving')


def main(args=None):
    rclpy.init(args=args)
    rclpy.spin(TurtleMover())
    rclpy.shutdown()


if __name__ == "__main__":
    main()
