import random
import threading
import rclpy
from std_msgs.msg import Float32


def main():
    rclpy.init()
    node = rclpy.create_node('temperature_sensor')
    pub = node.create_publisher(Float32, 'temperature', 10)
    node.create_subscription(Float32, 'fan_speed', lambda m: node.get_logger().info(f'Fan speed: {m.data:.0f}%'), 10)
    spinner = threading.Thread(target=rclpy.spin, args=(node,), daemon=True)
    spinner.start()
    rate = node.create_rate(5)
    while rclpy.ok():
        pub.publish(Float32(data=random.uniform(20, 30)))
        rate.sleep()


if __name__ == '__main__':
    main()
