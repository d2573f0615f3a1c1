import rclpy
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import MultiThreadedExecutor
from rclpy.node import Node
from std_msgs.msg import Float32


class FanController(Node):
    def __init__(self):
        super().__init__('fan_controller')
        group = ReentrantCallbackGroup()
        self.temperature = None
        self.pub = self.create_publisher(Float32, 'fan_speed', 10)
        self.create_subscription(Float32, 'temperature', self.store, 10, callback_group=group)
        self.create_timer(0.1, self.act, callback_group=group)

    def store(self, msg):
        self.temperature = msg.data

    def act(self):
        if self.temperature is None:
            return
        self.pub.publish(Float32(data=100.0 if self.temperature > 25.0 else 0.0))


def main():
    rclpy.init()
    executor = MultiThreadedExecutor()
    executor.add_node(FanController())
    executor.spin()


if __name__ == '__main__':
    main()
