import rclpy
from rclpy.node import Node
from sensor_msgs.msg import Temperature
from std_msgs.msg import Int32


class FanController(Node):
    def __init__(self):
        super().__init__('fan_controller')
        self.pub = self.create_publisher(Int32, '/fan_speed', 10)
        self.create_subscription(Temperature, '/temperature', self.control, 10)

    def control(self, msg: Temperature):
        speed = Int32()
        speed.data = 100 if msg.temperature > 25.0 else 0
        self.pub.publish(speed)
        self.get_logger().info(f'{msg.temperature:.1f} °C: fan {speed.data} %')


def main():
    rclpy.init()
    rclpy.spin(FanController())


if __name__ == '__main__':
    main()
