import random
import time
import rclpy
from std_msgs.msg import Float32


def main():
    rclpy.init()
    node = rclpy.create_node('temperature_sensor')
    pub = node.create_publisher(Float32, '/temperature', 10)

    def fan_speed(msg):
        node.get_logger().info(f'Fan speed received: {msg.data}')

    node.create_subscription(Float32, '/fan_speed', fan_speed, 10)
    msg = Float32()
    try:
        while rclpy.ok():
            start = time.time()
            msg.data = 20.0 + random.random() * 10.0
            pub.publish(msg)
            while time.time() - start < 0.2:
                rclpy.spin_once(node, timeout_sec=0.01)
    except KeyboardInterrupt:
        pass


if __name__ == '__main__':
    main()
