import rclpy
from rclpy.node import Node
from geometry_msgs.msg import Vector3


class VelocityPublisher(Node):
    def __init__(self):
        super().__init__('velocity_publisher')
        self.pub = self.create_publisher(Vector3, '/cmd_vel', 10)
        self.timer = self.create_timer(0.05, self.tick)
        self.get_logger().info('started')

    def tick(self):
        self.pub.publish(Vector3(x=0.5, y=0.0, z=0.1))


def main():
    rclpy.init()
    rclpy.spin(VelocityPublisher())


if __name__ == '__main__':
    main()
