import rclpy
from rclpy.node import Node
from std_msgs.msg import Float32


class FanController(Node):
    def __init__(self):
        super().__init__("fan_controller")
        self.publisher = self.create_publisher(Float32, "/fan_speed", 10)
        self.create_subscription(Float32, "/temperature", self.callback, 10)

    def callback(self, msg):
        self.publisher.publish(Float32(data=0.0))
        self.publisher.publish(Float32(data=100.0))


def main():
    rclpy.init()
    rclpy.spin(FanController())


if __name__ == "__main__":
    main()
