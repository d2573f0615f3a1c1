import rclpy
from rclpy.node import Node
from std_msgs.msg import Float32


class FanNode(Node):
    def __init__(self):
        super().__init__('fan_node')
        self.pub = self.create_publisher(Float32, '/fan_speed', 10)
        self.sub = self.create_subscription(Float32, '/temperature', self.temp_cb, 10)

    def temp_cb(self, msg):
        speed = Float32()
        match msg.data > 25.0:
            case True:
                speed.data = 100.0
            case _:
                speed.data = 0.0
        self.pub.publish(speed)
        self.get_logger().info('T=%.1f fan=%.1f' % (msg.data, speed.data))


def main():
    rclpy.init()
    rclpy.spin(FanNode())


if __name__ == '__main__':
    main()
