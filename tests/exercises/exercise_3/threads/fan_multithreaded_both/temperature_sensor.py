import random
import rclpy
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.executors import MultiThreadedExecutor
from rclpy.node import Node
from std_msgs.msg import Float32, Int32


class TemperatureSensor(Node):
    def __init__(self):
        super().__init__('temperature_sensor')
        self.pub = self.create_publisher(Float32, '/temperature', 10)
        self.create_subscription(
            Int32, '/fan_speed', self.fan, 10, callback_group=MutuallyExclusiveCallbackGroup())
        self.create_timer(0.2, self.tick, callback_group=MutuallyExclusiveCallbackGroup())

    def tick(self):
        self.pub.publish(Float32(data=random.uniform(20.0, 30.0)))

    def fan(self, msg):
        self.get_logger().info(f'fan {msg.data}')


def main():
    rclpy.init()
    executor = MultiThreadedExecutor(2)
    executor.add_node(TemperatureSensor())
    executor.spin()


if __name__ == '__main__':
    main()
