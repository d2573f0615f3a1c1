import rclpy
from rclpy.node import Node
from std_msgs.msg import Float32, Int32


class FanController(Node):

    def __init__(self):
        super().__init__('fan_controller')
        self.temperature = 0.0
        self.publisher = self.create_publisher(Int32, 'fan_speed', 10)
        self.subscription = self.create_subscription(Float32, 'temperature', self.temperature_callback, 10)

    def temperature_callback(self, msg):
        self.temperature = msg.data
        self.publish_fan_speed()

    def publish_fan_speed(self):
        msg = Int32()
        if self.temperature > 25.0:
            msg.data = 100
        elif self.temperature <= 25.0:
            msg.data = 0
        self.publisher.publish(msg)
        self.get_logger().debug('fan %d' % msg.data)


def main(args=None):
    rclpy.init(args=args)
    node = FanController()
    rclpy.spin_until_future_complete(node, rclpy.task.Future())
    node.destroy_node()
    rclpy.shutdown()


if __name__ == '__main__':
    main()
