import math
import rclpy
from rclpy.node import Node
from std_msgs.msg import String


class Text(Node):
    def __init__(self):
        super().__init__('text')
        self.pub = self.create_publisher(String, '/joint_commands', 10)
        self.counter = 0
        self.create_timer(0.1, self.tick)

    def tick(self):
        angle = math.sin(self.counter * 0.1)
        self.pub.publish(String(data=str(angle)))
        if self.counter % 10 == 0:
            self.get_logger().info(f'{angle:.3f}')
        self.counter += 1


rclpy.init()
rclpy.spin(Text())
