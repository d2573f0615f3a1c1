import threading

import rclpy
from rclpy.node import Node
from geometry_msgs.msg import Twist


class Beat(threading.Thread):
    def __init__(self, every, action):
        super().__init__(daemon=True)
        self.every = every
        self.action = action
        self.stop = threading.Event()

    def run(self):
        while not self.stop.wait(self.every):
            self.action()


class VelocityPublisher(Node):
    def __init__(self):
        Node.__init__(self, 'velocity_publisher')
        self.pub = self.create_publisher(Twist, '/cmd_vel', 10)
        self.lock = threading.RLock()
        self.count = 0
        self.beat = Beat(0.05, self.send)
        self.beat.start()

    def send(self):
        with self.lock:
            msg = Twist()
            msg.linear.x = 0.5
            msg.angular.z = 0.1
            self.pub.publish(msg)
            self.count += 1
            if self.count == 1:
                self.get_logger().info('first command sent')


def main():
    rclpy.init()
    node = VelocityPublisher()
    try:
        rclpy.spin(node)
    except KeyboardInterrupt:
        pass
    finally:
        node.beat.stop.set()
        node.beat.join()


if __name__ == '__main__':
    main()
