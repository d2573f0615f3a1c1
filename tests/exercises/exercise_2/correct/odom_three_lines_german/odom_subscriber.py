import rclpy
from rclpy.node import Node
from nav_msgs.msg import Odometry


def deutsch(zahl):
    return '{:.3f}'.format(zahl).replace('.', ',')


class Ort(Node):
    def __init__(self):
        super().__init__('ort')
        self.daten_da = False
        self.create_subscription(Odometry, '/odom', self.merke, 10)
        self.create_timer(1, self.melde)

    def merke(self, nachricht):
        self.daten_da = True
        self.ort = nachricht.pose.pose.position

    def melde(self):
        if self.daten_da:
            self.get_logger().info('--- Roboterposition ---')
            self.get_logger().info('x = ' + deutsch(self.ort.x) + ' m')
            self.get_logger().info('y = ' + deutsch(self.ort.y) + ' m')
        else:
            self.get_logger().info('noch keine Daten')


def main():
    rclpy.init()
    knoten = Ort()
    try:
        rclpy.spin(knoten)
    except KeyboardInterrupt:
        knoten.get_logger().info('Ende')
    finally:
        knoten.destroy_node()
        if rclpy.ok():
            rclpy.shutdown()


if __name__ == '__main__':
    main()
