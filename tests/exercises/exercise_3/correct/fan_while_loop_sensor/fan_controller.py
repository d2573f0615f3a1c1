import rclpy
from std_msgs.msg import Float32

node = None
pub = None


def temperature(msg):
    answer = Float32()
    answer.data = float(100 * int(msg.data > 25))
    pub.publish(answer)


def main():
    global node, pub
    rclpy.init()
    node = rclpy.create_node('fan_controller')
    pub = node.create_publisher(Float32, '/fan_speed', 10)
    sub = node.create_subscription(Float32, '/temperature', temperature, 10)
    while rclpy.ok():
        rclpy.spin_once(node, timeout_sec=0.1)


if __name__ == '__main__':
    main()
