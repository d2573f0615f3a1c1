import rclpy
from rclpy.node import Node
from std_msgs.msg import Float32, Int32


class FanController(Node):
    def __init__(self):
        super().__init__('fan_controller')
        self.pub = self.create_publisher(Int32, '/fan_speed', 10)
        self.create_subscription(Float32, '/temperature', self.cb, 10)

    def cb(self, msg):
        self.pub.publish(Int32(data=100 if msg.data > 25.0 else 0))


def main(args=None):
    rclpy.init(args=args)
    rclpy.spin(FanController())


if __name__ == '__main__':
    main()
