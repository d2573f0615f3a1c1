import rclpy
from rclpy.duration import Duration
from rclpy.node import Node
from geometry_msgs.msg import Twist


class Vel(Node):
    def __init__(self):
        super().__init__('vel')
        self.pub = self.create_publisher(Twist, '/cmd_vel', 10)

    def run(self):
        msg = Twist()
        msg.linear.x = 0.5
        msg.angular.z = 0.1
        self.get_logger().info('running')
        while rclpy.ok():
            self.pub.publish(msg)
            self.get_clock().sleep_for(Duration(seconds=0.05))


def main():
    rclpy.init()
    Vel().run()


if __name__ == '__main__':
    main()
