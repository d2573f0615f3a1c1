import rclpy
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import MultiThreadedExecutor
from rclpy.node import Node
from geometry_msgs.msg import Twist


class VelocityPublisher(Node):
    def __init__(self):
        super().__init__('velocity_publisher')
        group = ReentrantCallbackGroup()
        self.pub = self.create_publisher(Twist, 'cmd_vel', 10)
        self.create_timer(0.05, self.send, callback_group=group)
        self.create_timer(1.0, self.alive, callback_group=group)

    def send(self):
        t = Twist()
        t.linear.x = 0.5
        t.angular.z = 0.1
        self.pub.publish(t)

    def alive(self):
        self.get_logger().info('still driving')


def main():
    rclpy.init()
    executor = MultiThreadedExecutor(num_threads=4)
    executor.add_node(VelocityPublisher())
    try:
        executor.spin()
    except KeyboardInterrupt:
        pass
    finally:
        executor.shutdown()


if __name__ == '__main__':
    main()
