import time

import rclpy
from rclpy.node import Node
from geometry_msgs.msg import Twist


class Publicador(Node):
    def __init__(self):
        super().__init__('publicador')
        self.pub = self.create_publisher(Twist, 'cmd_vel', 10)
        self.get_logger().info('nodo iniciado')

    def publicar(self):
        vel = Twist()
        vel.linear.x = 0.5
        vel.angular.z = 0.1
        self.pub.publish(vel)


def main(args=None):
    rclpy.init(args=args)
    nodo = Publicador()
    while rclpy.ok():
        nodo.publicar()
        rclpy.spin_once(nodo, timeout_sec=0.05)
        time.sleep(0.05)


if __name__ == '__main__':
    main()
