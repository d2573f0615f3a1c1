import rclpy
from rclpy.node import Node
from rclpy.qos import HistoryPolicy, QoSProfile
from sensor_msgs.msg import Temperature
from std_msgs.msg import Int32


class FanController(Node):
    def __init__(self):
        super().__init__('fan_controller')
        self.qos = QoSProfile(depth=1, history=HistoryPolicy.KEEP_LAST)
        self.subscription = self.create_subscription(Temperature, 'temperature', self.on_temperature, self.qos)
        self.publisher = self.create_publisher(Int32, 'fan_speed', self.qos)

    def on_temperature(self, msg):
        out = Int32()
        out.data = int(msg.temperature > 25) * 100
        self.publisher.publish(out)


def main(args=None):
    rclpy.init(args=args)
    node = FanController()
    rclpy.spin(node)
    node.destroy_node()
    rclpy.shutdown()


if __name__ == '__main__':
    main()
