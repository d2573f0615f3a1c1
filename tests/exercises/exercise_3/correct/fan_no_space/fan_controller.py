import rclpy
from rclpy.node import Node
from std_msgs.msg import Int32


class FanController(Node):
    def __init__(self):
        super().__init__("fan_controller")
        self.pub = self.create_publisher(Int32, "/fan_speed", 10)
        self.sub = self.create_subscription(Int32, "/temperature", self.temp, 10)

    def temp(self, msg):
        out = Int32()
        if msg.data > 25:
            out.data = 100
        else:
            out.data = 0
        self.pub.publish(out)


def main():
    rclpy.init()
    node = FanController()
    try:
        rclpy.spin(node)
    except KeyboardInterrupt:
        pass


if __name__ == "__main__":
    main()
