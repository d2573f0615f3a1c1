from time import sleep

import rclpy
from rclpy.node import Node
from std_msgs.msg import Float32


class Ventilateur(Node):
    def __init__(self):
        super().__init__('ventilateur')
        self.pub = self.create_publisher(Float32, '/fan_speed', 10)
        self.create_subscription(Float32, '/temperature', self.recu, 10)

    def recu(self, msg):
        self.get_logger().info('température : %.1f' % msg.data)
        if msg.data > 25.0:
            self.allumer()
        else:
            self.pub.publish(Float32(data=0.0))

    def allumer(self):
        self.pub.publish(Float32(data=100.0))
        sleep(3)


def main():
    rclpy.init()
    rclpy.spin(Ventilateur())


if __name__ == '__main__':
    main()
