import secrets
import rclpy
from rclpy.node import Node
from std_msgs.msg import Int8


class TemperatureSensor(Node):
    def __init__(self):
        super().__init__('temperature_sensor')
        self.pub = self.create_publisher(Int8, '/temperature', 10)
        self.sub = self.create_subscription(Int8, '/fan_speed', self.fan_cb, 10)
        self.timer = self.create_timer(0.2, self.tick)

    def tick(self):
        msg = Int8()
        msg.data = secrets.choice(range(20, 31))
        self.pub.publish(msg)

    def fan_cb(self, msg):
        self.get_logger().info('fan speed = %d' % msg.data)


def main(args=None):
    rclpy.init(args=args)
    rclpy.spin(TemperatureSensor())


if __name__ == '__main__':
    main()
