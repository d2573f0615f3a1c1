import random
import rclpy
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from std_msgs.msg import Float32, Int64


class RoomSimulator(Node):
    def __init__(self):
        super().__init__('room_simulator')
        self.t = random.uniform(22.0, 28.0)
        self.pub = self.create_publisher(Float32, 'temperature', qos_profile_sensor_data)
        self.create_subscription(Int64, 'fan_speed', self.fan, qos_profile_sensor_data)
        self.create_timer(0.2, self.step)

    def step(self):
        self.t = min(30.0, max(20.0, self.t + random.uniform(-2.5, 2.5)))
        self.pub.publish(Float32(data=self.t))

    def fan(self, msg):
        self.get_logger().info('received fan speed: {}'.format(msg.data))


def main():
    rclpy.init()
    rclpy.spin(RoomSimulator())


if __name__ == '__main__':
    main()
