import rclpy
from rclpy.node import Node
from example_interfaces.msg import Float32


class FanController(Node):
    def __init__(self):
        super().__init__('fan_controller')
        self.pub = self.create_publisher(Float32, 'fan_speed', 10)
        self.sub = self.create_subscription(Float32, 'temperature', self.on_temperature, 10)

    def on_temperature(self, msg):
        speed = Float32()
        speed.data = 100.0 if msg.data > 25.0 else 0.0
        self.pub.publish(speed)
        self.get_logger().info(f'{msg.data:.1f} C -> {speed.data:.0f} %')


def main(args=None):
    rclpy.init(args=args)
    rclpy.spin(FanController())


if __name__ == '__main__':
    main()
