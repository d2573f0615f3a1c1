import rclpy
from numpy.random import uniform
from rclpy.node import Node
from std_msgs.msg import Float32


class TemperatureSensor(Node):
    def __init__(self):
        super().__init__('temperature_sensor')
        self.pub = self.create_publisher(Float32, '/temperature', 10)
        self.create_subscription(Float32, '/fan_speed', self.fan, 10)
        self.create_timer(0.2, self.tick)

    def tick(self):
        self.pub.publish(Float32(data=float(uniform(20.0, 30.0))))

    def fan(self, msg):
        self.get_logger().info(f'Fan speed: {msg.data}')


def main(args=None):
    rclpy.init(args=args)
    rclpy.spin(TemperatureSensor())


if __name__ == '__main__':
    main()
