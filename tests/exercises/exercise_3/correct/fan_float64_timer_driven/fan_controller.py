import rclpy
from rclpy.node import Node
from std_msgs.msg import Float64


class Controller(Node):
    def __init__(self):
        super().__init__('fan_controller')
        self.temperature = None
        self.pub = self.create_publisher(Float64, '/fan_speed', 10)
        self.create_subscription(Float64, '/temperature', self.remember, 10)
        self.create_timer(0.5, self.control)

    def remember(self, msg):
        self.temperature = msg.data

    def control(self):
        if self.temperature is None:
            return
        self.pub.publish(Float64(data=100.0 if self.temperature > 25.0 else 0.0))


def main():
    rclpy.init()
    rclpy.spin(Controller())


if __name__ == '__main__':
    main()
