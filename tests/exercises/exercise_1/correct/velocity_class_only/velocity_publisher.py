from geometry_msgs.msg import Twist
from rclpy.node import Node


class VelocityPublisher(Node):
    """Drives in a circle."""

    def __init__(self, name='velocity_publisher', speed=0.5, turn=0.1):
        super().__init__(name)
        self.speed = speed
        self.turn = turn
        self.publisher = self.create_publisher(Twist, '/cmd_vel', 10)
        self.timer = self.create_timer(0.05, self.publish)

    def publish(self):
        msg = Twist()
        msg.linear.x = self.speed
        msg.angular.z = self.turn
        self.publisher.publish(msg)
        self.get_logger().info(f'published {self.speed}, {self.turn}')
