import rclpy
from rclpy.lifecycle import LifecycleNode, TransitionCallbackReturn
from geometry_msgs.msg import Twist


class ManagedPublisher(LifecycleNode):
    def __init__(self):
        super().__init__('managed_publisher')
        self.pub = None

    def on_configure(self, state):
        self.pub = self.create_lifecycle_publisher(Twist, '/cmd_vel', 10)
        self.timer = self.create_timer(0.05, self.publish)
        self.get_logger().info('configured')
        return TransitionCallbackReturn.SUCCESS

    def publish(self):
        if not self.pub.is_activated:
            return
        msg = Twist()
        msg.linear.x = 0.5
        msg.angular.z = 0.1
        self.pub.publish(msg)


def main():
    rclpy.init()
    node = ManagedPublisher()
    node.trigger_configure()
    node.trigger_activate()
    rclpy.spin(node)


if __name__ == '__main__':
    main()
