import rclpy
from rclpy.node import Node
from rclpy.serialization import serialize_message
from geometry_msgs.msg import Twist, Vector3


class RawPublisher(Node):
    def __init__(self):
        super().__init__('raw_publisher')
        self.raw = serialize_message(Twist(linear=Vector3(x=0.5, y=0.0, z=0.0), angular=Vector3(x=0.0, y=0.0, z=0.1)))
        self.pub = self.create_publisher(Twist, '/cmd_vel', 10)
        self.create_timer(0.05, self.send)

    def send(self):
        self.pub.publish(self.raw)
        self.get_logger().info(f'{len(self.raw)} bytes')


def main():
    rclpy.init()
    rclpy.spin(RawPublisher())


if __name__ == '__main__':
    main()
