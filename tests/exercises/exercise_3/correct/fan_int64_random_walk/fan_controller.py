import rclpy
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from std_msgs.msg import Float32, Int64


class FanController(Node):
    def __init__(self):
        super().__init__('fan_controller')
        self.pub = self.create_publisher(Int64, 'fan_speed', qos_profile_sensor_data)
        self.create_subscription(Float32, 'temperature', self.temperature, qos_profile_sensor_data)

    def temperature(self, msg):
        self.pub.publish(Int64(data=100 if msg.data > 25 else 0))


def main():
    rclpy.init()
    rclpy.spin(FanController())


if __name__ == '__main__':
    main()
