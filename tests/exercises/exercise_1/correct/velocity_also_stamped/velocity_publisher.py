import rclpy
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup
from rclpy.executors import MultiThreadedExecutor
from rclpy.node import Node
from geometry_msgs.msg import Twist, TwistStamped
from std_msgs.msg import Bool
from std_srvs.srv import SetBool


class VelocityPublisher(Node):
    """Sends plain and stamped commands; an emergency stop and a service can hold it."""

    def __init__(self):
        super().__init__('velocity_publisher')
        self.enabled = True
        fast, slow = MutuallyExclusiveCallbackGroup(), MutuallyExclusiveCallbackGroup()
        self.plain = self.create_publisher(Twist, '/cmd_vel', 10)
        self.stamped = self.create_publisher(TwistStamped, '/cmd_vel_stamped', 10)
        self.create_subscription(Bool, '/emergency_stop', self.on_stop, 1, callback_group=slow)
        self.create_service(SetBool, 'enable', self.on_enable, callback_group=slow)
        self.create_timer(0.05, self.on_fast, callback_group=fast)
        self.create_timer(1.0, self.on_slow, callback_group=slow)
        self.create_timer(3.0, lambda: None)

    def on_stop(self, msg):
        self.enabled = not msg.data

    def on_enable(self, request, response):
        self.enabled = request.data
        response.success = True
        return response

    def on_slow(self):
        self.get_logger().info('enabled' if self.enabled else 'held')

    def on_fast(self):
        if not self.enabled:
            return
        stamped = TwistStamped()
        stamped.header.stamp = self.get_clock().now().to_msg()
        stamped.header.frame_id = 'base_link'
        stamped.twist.linear.x = 0.5
        stamped.twist.angular.z = 0.1
        self.stamped.publish(stamped)
        self.plain.publish(stamped.twist)


def main():
    rclpy.init()
    executor = MultiThreadedExecutor(num_threads=3)
    node = VelocityPublisher()
    executor.add_node(node)
    try:
        executor.spin()
    except KeyboardInterrupt:
        pass
    finally:
        executor.shutdown()
        node.destroy_node()


if __name__ == '__main__':
    main()
