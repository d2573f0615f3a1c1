import rclpy
from rclpy.node import Node
from geometry_msgs.msg import Twist


class Slalom(Node):
    def __init__(self):
        super().__init__('slalom')
        self.pub = self.create_publisher(Twist, '/cmd_vel', 10)
        self.turn = 0.1
        self.create_timer(0.05, self.send)
        self.create_timer(2.0, self.change)

    def change(self):
        self.turn = -self.turn
        self.get_logger().info(f'now turning with {self.turn}')

    def send(self):
        cmd = Twist()
        cmd.linear.x = 0.5
        cmd.angular.z = self.turn
        self.pub.publish(cmd)


def main():
    rclpy.init()
    rclpy.spin(Slalom())


if __name__ == '__main__':
    main()
