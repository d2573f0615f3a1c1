import rclpy
from rclpy.node import Node
from std_msgs.msg import Float64, UInt16

THRESHOLD = 25.0


class Controller(Node):
    def __init__(self):
        super().__init__('controller')
        self.fan = self.create_publisher(UInt16, 'fan_speed', 10)
        self.create_subscription(Float64, 'temperature', lambda m: self.set_fan(m.data > THRESHOLD), 10)

    def set_fan(self, on):
        self.fan.publish(UInt16(data=100 * on))
        self.get_logger().info('Fan ON' if on else 'Fan OFF')


def main():
    rclpy.init()
    rclpy.spin(Controller())


if __name__ == '__main__':
    main()
