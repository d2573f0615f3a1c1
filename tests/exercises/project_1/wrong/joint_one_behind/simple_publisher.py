import math
import rclpy
from rclpy.node import Node
from std_msgs.msg import Float64


class Behind(Node):
    """Publishes the angle, then computes the next from a counter that it raises afterwards."""

    def __init__(self):
        super().__init__('behind')
        self.pub = self.create_publisher(Float64, '/joint_commands', 10)
        self.counter = 0
        self.angle = 0.0
        self.create_timer(0.1, self.tick)

    def tick(self):
        self.pub.publish(Float64(data=self.angle))
        self.angle = math.sin(self.counter * 0.1)
        if self.counter % 10 == 0:
            self.get_logger().info(f'{self.angle:.3f}')
        self.counter += 1


rclpy.init()
rclpy.spin(Behind())
