import numpy as np
import rclpy
from rclpy.node import Node
from std_msgs.msg import Float64


class Base(Node):
    def __init__(self, name, out, into):
        super().__init__(name)
        self._out = self.create_publisher(Float64, out, 10)
        self.create_subscription(Float64, into, lambda msg: self.received(msg.data), 10)

    def send(self, value):
        self._out.publish(Float64(data=float(value)))

    def received(self, value):
        raise NotImplementedError


class Sensor(Base):
    def __init__(self):
        super().__init__('temperature_sensor', 'temperature', 'fan_speed')
        self.rng = np.random.default_rng()
        self.create_timer(0.2, self.measure)

    def measure(self):
        self.send(np.round(self.rng.uniform(20, 30), 2))

    def received(self, value):
        self.get_logger().info('fan at {:.0f} percent'.format(value))


def main():
    rclpy.init()
    rclpy.spin(Sensor())


if __name__ == '__main__':
    main()
