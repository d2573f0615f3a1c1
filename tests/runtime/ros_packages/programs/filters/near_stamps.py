"""Two sensors that do not measure at the same time: pairs that lie 30 ms apart."""

import rclpy
from builtin_interfaces.msg import Time
from message_filters import ApproximateTimeSynchronizer, Subscriber
from rclpy.node import Node
from sensor_msgs.msg import FluidPressure, Temperature


class Weather(Node):
    def __init__(self):
        super().__init__("weather")
        self.subs = [Subscriber(self, Temperature, "temperature"), Subscriber(self, FluidPressure, "pressure")]
        self.sync = ApproximateTimeSynchronizer(self.subs, queue_size=10, slop=0.05)
        self.sync.registerCallback(self.both)
        self.temperature = self.create_publisher(Temperature, "temperature", 10)
        self.pressure = self.create_publisher(FluidPressure, "pressure", 10)
        self.count = self.seen = 0
        self.create_timer(0.1, self.send)

    def send(self):
        self.count += 1
        warm, air = Temperature(temperature=20.0 + self.count), FluidPressure(fluid_pressure=1000.0 + self.count)
        warm.header.stamp = Time(sec=self.count)
        air.header.stamp = Time(sec=self.count, nanosec=30_000_000)
        self.temperature.publish(warm)
        self.pressure.publish(air)

    def both(self, warm, air):
        apart = air.header.stamp.nanosec - warm.header.stamp.nanosec
        same = warm.temperature - 20.0 == air.fluid_pressure - 1000.0
        self.get_logger().info(f"{apart // 1_000_000} ms apart, of one measurement: {same}")
        self.seen += 1
        if self.seen == 3:
            raise SystemExit


rclpy.init()
rclpy.spin(Weather())

# logs: 30 ms apart, of one measurement: True
# logs: 30 ms apart, of one measurement: True
# logs: 30 ms apart, of one measurement: True
