import random
import rclpy
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from std_msgs.msg import Float32, Int32


class TemperatureSensor(Node):
    def __init__(self):
        super().__init__('temperature_sensor')
        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self.pub = self.create_publisher(Float32, '/temperature', 10)
        self.sub = self.create_subscription(Int32, '/fan_speed', self.on_speed, latched)
        self.timer = self.create_timer(0.2, self.publish_temperature)

    def publish_temperature(self):
        self.pub.publish(Float32(data=round(random.uniform(20.0, 30.0), 1)))

    def on_speed(self, msg):
        self.get_logger().info(f'Fan speed is now {msg.data}')


def main(args=None):
    rclpy.init(args=args)
    rclpy.spin(TemperatureSensor())


if __name__ == '__main__':
    main()
