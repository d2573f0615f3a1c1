import time
import random
import rclpy
from std_msgs.msg import Float64


def main():
    rclpy.init()
    node = rclpy.create_node('temperature_sensor')
    pub = node.create_publisher(Float64, '/temperature', 10)
    node.create_subscription(
        Float64, '/fan_speed', lambda msg: node.get_logger().info('Lüfterdrehzahl: %.1f %%' % msg.data), 10)
    while rclpy.ok():
        pub.publish(Float64(data=random.uniform(20, 30)))
        rclpy.spin_once(node, timeout_sec=0)
        time.sleep(0.2)


if __name__ == '__main__':
    main()
