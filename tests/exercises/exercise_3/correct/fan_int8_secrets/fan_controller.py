import rclpy
from rclpy.node import Node
from std_msgs.msg import Int8


class FanController(Node):
    def __init__(self):
        super().__init__('fan_controller')
        self.pub = self.create_publisher(Int8, '/fan_speed', 10)
        self.sub = self.create_subscription(Int8, '/temperature', self.cb, 10)

    def cb(self, msg):
        out = Int8()
        if msg.data > 25:
            out.data = 100
        else:
            out.data = 0
        self.pub.publish(out)
        self.get_logger().info(f'{msg.data} degrees -> fan {out.data}')


def main(args=None):
    rclpy.init(args=args)
    rclpy.spin(FanController())


if __name__ == '__main__':
    main()
