from functools import partial

import rclpy
from std_msgs.msg import Float32, Int32


def switch(publisher, limit, msg):
    publisher.publish(Int32(data=100) if msg.data > limit else Int32())


def main():
    rclpy.init()
    node = rclpy.create_node('fan_controller')
    publisher = node.create_publisher(Int32, 'fan_speed', 10)
    node.create_subscription(Float32, 'temperature', partial(switch, publisher, 25.0), 10)
    rclpy.spin(node)


if __name__ == '__main__':
    main()
