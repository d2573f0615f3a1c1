import rclpy
from rclpy.executors import MultiThreadedExecutor
from rclpy.node import Node
from std_msgs.msg import Float32


class Fan(Node):
    def __init__(self):
        super().__init__('fan')
        self.pub = self.create_publisher(Float32, '/fan_speed', 10)
        self.create_subscription(Float32, '/temperature', self.temperature, 10)

    def temperature(self, msg):
        self.pub.publish(Float32(data=100.0 if msg.data > 25.0 else 0.0))


def main():
    rclpy.init()
    executor = MultiThreadedExecutor()
    executor.add_node(Fan())
    executor.spin()


if __name__ == '__main__':
    main()
