import queue
import threading
import rclpy
from rclpy.node import Node
from geometry_msgs.msg import Twist


class Pipeline(Node):
    def __init__(self):
        super().__init__('pipeline')
        self.pub = self.create_publisher(Twist, '/cmd_vel', 10)
        self.jobs = queue.Queue()
        threading.Thread(target=self.worker, daemon=True).start()
        self.create_timer(0.05, self.produce)

    def produce(self):
        self.jobs.put((0.5, 0.1))

    def worker(self):
        while True:
            v, w = self.jobs.get()
            msg = Twist()
            msg.linear.x = v
            msg.angular.z = w
            self.pub.publish(msg)
            self.get_logger().info(f'{v} {w}')


def main():
    rclpy.init()
    rclpy.spin(Pipeline())


if __name__ == '__main__':
    main()
