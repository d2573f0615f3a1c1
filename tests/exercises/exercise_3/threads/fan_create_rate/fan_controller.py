import threading
import time
import rclpy
from std_msgs.msg import Float32

temperature = None


def heard(msg):
    global temperature
    temperature = msg.data


def main():
    rclpy.init()
    node = rclpy.create_node('fan_controller')
    pub = node.create_publisher(Float32, 'fan_speed', 10)
    node.create_subscription(Float32, 'temperature', heard, 10)
    threading.Thread(target=rclpy.spin, args=(node,), daemon=True).start()
    while rclpy.ok():
        if temperature is not None:
            pub.publish(Float32(data=100.0 if temperature > 25.0 else 0.0))
        time.sleep(0.1)


if __name__ == '__main__':
    main()
