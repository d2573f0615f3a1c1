import rclpy
from rclpy.node import Node
from geometry_msgs.msg import Twist


class VelocityPublisher(Node):
    def __init__(self, speed, turn):
        super().__init__('velocity_publisher')
        self.pub = self.create_publisher(Twist, '/cmd_vel', 10)
        self.speed, self.turn = speed, turn
        self.create_timer(0.05, self.cb)

    def cb(self):
        msg = Twist()
        msg.linear.x = self.speed
        msg.angular.z = self.turn
        self.pub.publish(msg)
        self.get_logger().info('sent')


def main():
    speed = float(input())
    turn = float(input())
    rclpy.init()
    rclpy.spin(VelocityPublisher(speed, turn))


if __name__ == '__main__':
    main()
