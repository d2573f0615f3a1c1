import threading
import rclpy
from rclpy.executors import SingleThreadedExecutor
from geometry_msgs.msg import Twist


def main():
    rclpy.init()
    driver = rclpy.create_node('driver')
    status = rclpy.create_node('status')
    pub = driver.create_publisher(Twist, '/cmd_vel', 10)
    cmd = Twist()
    cmd.linear.x = 0.5
    cmd.angular.z = 0.1
    driver.create_timer(0.05, lambda: pub.publish(cmd))
    status.create_timer(1.0, lambda: status.get_logger().info('alive'))

    first, second = SingleThreadedExecutor(), SingleThreadedExecutor()
    first.add_node(driver)
    second.add_node(status)
    thread = threading.Thread(target=second.spin, daemon=True)
    thread.start()
    try:
        first.spin()
    except KeyboardInterrupt:
        pass


if __name__ == '__main__':
    main()
