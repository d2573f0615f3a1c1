import rclpy
from rclpy.node import Node
from rclpy.task import Future
from geometry_msgs.msg import Twist


def main():
    rclpy.init()
    node = Node('velocity_publisher')
    pub = node.create_publisher(Twist, '/cmd_vel', 10)
    log = node.get_logger()
    done = Future()

    def step():
        msg = Twist()
        msg.linear.x = 0.5
        msg.angular.z = 0.1
        pub.publish(msg)
        log.info('step', once=True)

    node.create_timer(0.05, step)
    rclpy.spin_until_future_complete(node, done)


if __name__ == '__main__':
    main()
