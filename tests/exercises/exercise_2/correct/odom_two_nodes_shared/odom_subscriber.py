import rclpy
from rclpy.executors import MultiThreadedExecutor
from rclpy.node import Node
from nav_msgs.msg import Odometry


class Memory:
    def __init__(self):
        self.position = None


class Listener(Node):
    def __init__(self, memory):
        super().__init__('listener')
        self.memory = memory
        self.create_subscription(Odometry, '/odom', self.hear, 10)

    def hear(self, msg):
        self.memory.position = msg.pose.pose.position


class Reporter(Node):
    def __init__(self, memory, every):
        super().__init__('reporter')
        self.memory = memory
        self.create_timer(every, self.speak)

    def speak(self):
        if (p := self.memory.position) is not None:
            self.get_logger().info(f'robot is {p.x:.2f} m ahead and {p.y:.2f} m to the left of its start')


class Application:
    def __init__(self, **options):
        memory = Memory()
        self.nodes = [Listener(memory), Reporter(memory, **options)]
        self.executor = MultiThreadedExecutor(num_threads=2)

    def __enter__(self):
        for node in self.nodes:
            self.executor.add_node(node)
        return self.executor

    def __exit__(self, kind, error, tb):
        for node in self.nodes:
            node.destroy_node()
        return kind is KeyboardInterrupt


def main():
    rclpy.init()
    with Application(every=1.0) as executor:
        executor.spin()


if __name__ == '__main__':
    main()
