import rclpy
from geometry_msgs.msg import Twist
from rclpy.node import Node

PERIOD = 0.05


class Fahren(Node):
    """Fährt geradeaus und dreht sich dabei."""

    def __init__(self):
        super().__init__('fahren')
        self.pub = self.create_publisher(Twist, 'cmd_vel', 1)
        self.befehl = Twist()
        self.create_timer(PERIOD, self.senden)
        self.get_logger().info('Fahrt beginnt')

    def senden(self):
        self.befehl.linear.x = 0.5
        self.befehl.angular.z = 0.1
        self.befehl = Twist()
        self.pub.publish(self.befehl)


def main():
    rclpy.init()
    rclpy.spin(Fahren())


if __name__ == '__main__':
    main()
