import random
import rclpy
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from std_msgs.msg import Float32, String
from std_srvs.srv import Trigger


class temperature_sensor(Node):
    def __init__(self):
        super().__init__('temperature_sensor')
        self.temperature_publisher = self.create_publisher(Float32, '/temperature', qos_profile_sensor_data)
        self.create_subscription(Float32, '/fan_speed', self.callback, 10)
        self.create_subscription(String, '/fan_status', self.status, 10)
        self.create_service(Trigger, '/calibrate', self.calibrate)
        self.offset = 0.0
        self.create_timer(0.2, self.timer)

    def calibrate(self, req, res):
        res.success, res.message = True, 'ok'
        return res

    def timer(self):
        temp = random.uniform(20, 30) + self.offset
        self.temperature_publisher.publish(Float32(data=temp))

    def callback(self, msg):
        rpm = msg.data * 24
        self.get_logger().info("fan: " + str(msg.data) + " %, " + str(rpm) + " rpm")

    def status(self, msg):
        self.get_logger().info(msg.data)


def main(args=None):
    rclpy.init(args=args)
    n = temperature_sensor()
    rclpy.spin(n)


if __name__ == '__main__':
    main()
