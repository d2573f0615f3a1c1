import signal
import rclpy
from rclpy.signals import SignalHandlerOptions
from geometry_msgs.msg import Twist

running = True


def on_sigint(signum, frame):
    global running
    running = False


def main():
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    signal.signal(signal.SIGINT, on_sigint)
    signal.signal(signal.SIGTERM, on_sigint)
    node = rclpy.create_node('velocity_publisher')
    pub = node.create_publisher(Twist, '/cmd_vel', 10)
    cmd = Twist()
    cmd.linear.x = 0.5
    cmd.angular.z = 0.1

    def timer_cb():
        pub.publish(cmd)
        node.get_logger().info('cmd sent', throttle_duration_sec=1)

    node.create_timer(0.05, timer_cb)
    while running:
        rclpy.spin_once(node, timeout_sec=0.1)
    node.get_logger().info('stopping the robot')
    pub.publish(Twist())
    node.destroy_node()
    rclpy.shutdown()


if __name__ == '__main__':
    main()
