import rclpy
from rclpy.node import Node
from std_msgs.msg import Float32


class FanController(Node):
    def __init__(self):
        super().__init__('fan_controller')
        self.sub = self.create_subscription(Float32, '/temperature', self.temperature_callback, 10)
        self.pub = self.create_publisher(Float32, '/fan_speed', 10)

    def temperature_callback(self, msg):
        fan = Float32()
        if msg.data > 25.0:
            fan.data = 100.0
        else:
            fan.data = 0.0
        self.pub.publish(fan)
        self.get_logger().info(f'{msg.data:.2f} °C -> fan {fan.data}')


def main(args=None):
    rclpy.init(args=args)
    node = FanController()
    try:
        rclpy.spin(node)
    except KeyboardInterrupt:
        pass
    node.destroy_node()
    rclpy.shutdown()


if __name__ == '__main__':
    main()
