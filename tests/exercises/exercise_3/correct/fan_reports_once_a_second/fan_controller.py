import rclpy
from rclpy.node import Node
from std_msgs.msg import Float32


class FanController(Node):
    ON, OFF = 100.0, 0.0

    def __init__(self):
        super().__init__('fan_controller')
        self.pub = self.create_publisher(Float32, '/fan_speed', 10)
        self.create_subscription(Float32, '/temperature', self.on_temperature, 10)

    def on_temperature(self, msg):
        if msg.data <= 25.0:
            speed = self.OFF
        elif msg.data > 25.0:
            speed = self.ON
        self.pub.publish(Float32(data=speed))


def main():
    rclpy.init()
    rclpy.spin(FanController())


if __name__ == '__main__':
    main()
