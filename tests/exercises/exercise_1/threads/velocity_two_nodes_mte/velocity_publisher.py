import rclpy
from rclpy.executors import MultiThreadedExecutor
from rclpy.node import Node
from geometry_msgs.msg import Twist


class VelocityPublisher(Node):
    def __init__(self):
        super().__init__('velocity_publisher')
        self.pub = self.create_publisher(Twist, '/cmd_vel', 10)
        self.create_timer(0.05, self.tick)

    def tick(self):
        msg = Twist()
        msg.linear.x = 0.5
        msg.angular.z = 0.1
        self.pub.publish(msg)


class Monitor(Node):
    def __init__(self):
        super().__init__('monitor')
        self.create_subscription(Twist, '/cmd_vel', self.seen, 10)

    def seen(self, msg):
        self.get_logger().info(f'linear {msg.linear.x}, angular {msg.angular.z}')


def main(args=None):
    rclpy.init(args=args)
    publisher, monitor = VelocityPublisher(), Monitor()
    executor = MultiThreadedExecutor(num_threads=4)
    executor.add_node(publisher)
    executor.add_node(monitor)
    try:
        executor.spin()
    finally:
        executor.shutdown()
        publisher.destroy_node()
        monitor.destroy_node()


if __name__ == '__main__':
    main()
