import random

import rclpy
from rclpy.node import Node
from std_msgs.msg import Float32


def main(args=None):
    rclpy.init(args=args)
    node = rclpy.create_node('temperature_sensor')
    speeds = []

    def listener(msg, info):
        speeds.append(msg.data)
        node.get_logger().warn(f'got {speeds[-1]:g} (number {len(speeds)}, {info["received_timestamp"] > 0})')

    publisher = node.create_publisher(Float32, 'temperature', 10)
    node.create_subscription(Float32, 'fan_speed', listener, 10)
    while rclpy.ok():
        publisher.publish(Float32(data=round(random.uniform(20.0, 30.0), 1)))
        end = node.get_clock().now().nanoseconds + 200_000_000
        while (left := end - node.get_clock().now().nanoseconds) > 0:
            rclpy.spin_once(node, timeout_sec=left / 1e9)


if __name__ == '__main__':
    try:
        main()
    except KeyboardInterrupt:
        pass
