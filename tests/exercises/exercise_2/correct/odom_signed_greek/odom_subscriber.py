import rclpy
from rclpy.node import Node
from nav_msgs.msg import Odometry


class ΣυνδρομητήςΘέσης(Node):
    def __init__(self):
        super().__init__('odom_subscriber')
        self.θέση = None
        self.create_subscription(Odometry, '/odom', self.λήψη, 10)
        self.create_timer(1.0, self.καταγραφή)

    def λήψη(self, μήνυμα):
        self.θέση = μήνυμα.pose.pose.position

    def καταγραφή(self):
        if self.θέση is None:
            self.get_logger().info('περιμένω δεδομένα …')
        else:
            self.get_logger().info('Θέση: χ={0.x:+.3f} μ, ψ={0.y:+.3f} μ'.format(self.θέση))


def main():
    rclpy.init()
    rclpy.spin(ΣυνδρομητήςΘέσης())


if __name__ == '__main__':
    main()
