from rclpy.node import Node
from std_msgs.msg import Float64, Int32


class Fan(Node):
    def __init__(self, threshold=25.0):
        super().__init__('fan')
        self.threshold = threshold
        self.p = self.create_publisher(Int32, '/fan_speed', 10)
        self.s = self.create_subscription(Float64, '/temperature', self.got, 10)

    def got(self, m):
        self.p.publish(Int32(data=100 if m.data > self.threshold else 0))
