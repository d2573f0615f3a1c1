import rclpy
from rclpy.node import Node
from std_msgs.msg import Float32, UInt32


class MinimalNode(Node):
    def __init__(self):
        super().__init__('node')
        self.publisher_ = self.create_publisher(UInt32, 'fan_speed', 10)
        self.subscription = self.create_subscription(Float32, 'temperature', self.listener_callback, 10)

    def listener_callback(self, msg):
        speed = UInt32()
        speed.data = {True: 100, False: 0}[msg.data > 25.0]
        self.publisher_.publish(speed)


def main(args=None):
    rclpy.init(args=args)
    node = MinimalNode()
    rclpy.spin(node)
    node.destroy_node()
    rclpy.shutdown()


if __name__ == '__main__':
    main()
