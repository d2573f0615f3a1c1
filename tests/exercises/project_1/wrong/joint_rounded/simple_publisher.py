import math
import rclpy
from rclpy.node import Node
from std_msgs.msg import Float64


class Rounded(Node):
    def __init__(self):
        super().__init__('rounded')
        self.pub = self.create_publisher(Float64, '/joint_commands', 10)
        self.counter = 0
        self.create_timer(0.1, self.tick)

    def tick(self):
        msg = Float64()
        msg.data = round(math.sin(0.1 * self.counter), 2)
        self.pub.publish(msg)
        if self.counter % 10 == 0:
            self.get_logger().info(f'{msg.data}')
        self.counter += 1


rclpy.init()
rclpy.spin(Rounded())
