import rclpy
from rclpy.node import Node
from std_msgs.msg import Float32, UInt8


class FanController(Node):
    def __init__(self):
        super().__init__('fan_controller')
        self.declare_parameter('threshold', 25)
        self.pub = self.create_publisher(Float32, '/fan_speed', 10)
        self.create_subscription(UInt8, '/temperature', self.callback, 10)

    def callback(self, msg):
        hot = msg.data > self.get_parameter('threshold').value
        self.pub.publish(Float32(data=100.0 if hot else 0.0))


def main():
    rclpy.init()
    rclpy.spin(FanController())


if __name__ == '__main__':
    main()
