import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from geometry_msgs.msg import Twist
from std_msgs.msg import String


class Commander(Node):
    def __init__(self):
        super().__init__('commander')
        pub = self.create_publisher(Twist, '/cmd_vel', 10)
        msg = Twist()
        msg.linear.x = 0.5
        msg.angular.z = 0.1
        self.create_timer(0.05, lambda: pub.publish(msg))


class Echo(Node):
    def __init__(self):
        super().__init__('echo')
        self.n = 0
        self.create_subscription(Twist, '/cmd_vel', self.cb, 10)
        self.create_timer(1.0, self.report)

    def cb(self, msg):
        self.n += 1

    def report(self):
        self.get_logger().info(f'{self.n} commands so far')


class Heartbeat(Node):
    def __init__(self):
        super().__init__('heartbeat')
        pub = self.create_publisher(String, 'heartbeat', 1)
        self.create_timer(0.33, lambda: pub.publish(String(data='ok')))


def main():
    rclpy.init()
    nodes = [Commander(), Echo(), Heartbeat()]
    executor = SingleThreadedExecutor()
    for node in nodes:
        executor.add_node(node)
    try:
        executor.spin()
    except KeyboardInterrupt:
        pass
    finally:
        for node in nodes:
            node.destroy_node()


if __name__ == '__main__':
    main()
