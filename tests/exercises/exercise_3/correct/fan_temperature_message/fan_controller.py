import rclpy
from rclpy.node import Node
from sensor_msgs.msg import Temperature
from std_msgs.msg import UInt8

THRESHOLD = 25.0


class FanController(Node):
    def __init__(self):
        super().__init__('fan_controller')
        self.fan_pub = self.create_publisher(UInt8, '/fan_speed', 10)
        self.create_subscription(Temperature, '/temperature', self.on_temperature, 10)

    def on_temperature(self, msg):
        self.fan_pub.publish(UInt8(data=100 * (msg.temperature > THRESHOLD)))


def main():
    rclpy.init()
    node = FanController()
    try:
        rclpy.spin(node)
    except KeyboardInterrupt:
        pass
    finally:
        node.destroy_node()
        rclpy.try_shutdown()


if __name__ == '__main__':
    main()
