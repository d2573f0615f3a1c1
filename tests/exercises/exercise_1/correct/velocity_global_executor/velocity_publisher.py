import enum
import itertools
import rclpy
from rclpy.node import Node
from geometry_msgs.msg import Twist


class Speed(float, enum.Enum):
    FORWARD = 0.5
    TURN = 0.1


class Gen(Node):
    def __init__(self):
        super().__init__('gen')
        self.pub = self.create_publisher(Twist, '/cmd_vel', 10)
        self.steps = self.commands()
        self.create_timer(0.05, lambda: next(self.steps))

    def commands(self):
        for n in itertools.count(1):
            msg = Twist()
            msg.linear.x = Speed.FORWARD.value
            msg.angular.z = Speed.TURN.value
            self.pub.publish(msg)
            if n % 20 == 1:
                self.get_logger().info(f'{n} messages')
            yield


def main():
    rclpy.init()
    executor = rclpy.get_global_executor()
    executor.add_node(Gen())
    executor.spin()


if __name__ == '__main__':
    main()
