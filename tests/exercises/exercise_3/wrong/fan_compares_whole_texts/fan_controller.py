import rclpy
from rclpy.node import Node
from std_msgs.msg import Float32


class FanController(Node):
    def __init__(self):
        super().__init__('fan_controller')
        self.publisher = self.create_publisher(Float32, '/fan_speed', 10)
        self.subscription = self.create_subscription(Float32, '/temperature', self.temperature_callback, 10)

    def temperature_callback(self, msg):
        speed = Float32()
        speed.data = 100.0 if str(msg.data) > '25.0' else 0.0
        self.publisher.publish(speed)


def main(args=None):
    rclpy.init(args=args)
    rclpy.spin(FanController())


if __name__ == '__main__':
    main()
