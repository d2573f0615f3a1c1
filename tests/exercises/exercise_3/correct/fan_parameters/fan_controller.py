import rclpy
from rclpy.node import Node
from std_msgs.msg import Float32


class FanController(Node):
    def __init__(self):
        super().__init__('fan_controller')
        self.declare_parameter('threshold', 25.0)
        self.declare_parameter('speeds', [0.0, 100.0])
        self.pub = self.create_publisher(Float32, 'fan_speed', 10)
        self.create_subscription(Float32, 'temperature', self.control, 10)

    def control(self, msg):
        threshold = self.get_parameter('threshold').value
        speeds = self.get_parameter('speeds').value
        msg.data = speeds[msg.data > threshold]
        self.pub.publish(msg)


def main(args=None):
    rclpy.init(args=args)
    node = FanController()
    try:
        rclpy.spin(node)
    finally:
        node.destroy_node()


if __name__ == '__main__':
    main()
