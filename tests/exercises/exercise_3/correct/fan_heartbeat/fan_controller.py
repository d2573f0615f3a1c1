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


class Controller(Base):
    """Speaks when the speed changes, and at least with every fifth temperature."""

    def __init__(self):
        super().__init__('fan_controller', out='fan_speed', into='temperature')
        self.state, self.since = None, 0

    def received(self, value):
        wanted = 100 if value > 25 else 0
        self.since += 1
        if wanted != self.state or self.since == 5:
            self.send(wanted)
            self.state, self.since = wanted, 0


def main():
    rclpy.init()
    rclpy.spin(Controller())


if __name__ == '__main__':
    main()
