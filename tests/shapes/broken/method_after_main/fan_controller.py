import rclpy
from rclpy.node import Node
from std_msgs.msg import Float32


class FanController(Node):
    def __init__(self):
        super().__init__('fan_controller')
        self.pub = self.create_publisher(Float32, '/fan_speed', 10)
        self.sub = self.create_subscription(Float32, '/temperature', self.callback, 10)

    def callback(self, msg):
        out = Float32()
        out.data = self.decide(msg.data)
        self.pub.publish(out)


def main(args=None):
    rclpy.init(args=args)
    rclpy.spin(FanController())


# warm: full speed
def decide(self, temperature):
    if temperature > 25.0:
        return 100.0
    return 0.0


if __name__ == '__main__':
    main()
