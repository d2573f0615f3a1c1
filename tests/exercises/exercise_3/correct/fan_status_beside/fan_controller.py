import rclpy
from enum import IntEnum
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from std_msgs.msg import Bool, Float32, String


class Fan(IntEnum):
    OFF = 0
    ON = 100


class fan_controller(Node):
    def __init__(self):
        super().__init__('fan_controller')
        self.fan = Fan.OFF
        self.speed = self.create_publisher(Float32, '/fan_speed', 10)
        self.status = self.create_publisher(String, '/fan_status', 10)
        self.running = self.create_publisher(Bool, '/fan_running', 10)
        self.create_subscription(Float32, '/temperature', self.callback, qos_profile_sensor_data)

    def decide(self, temperature):
        match temperature:
            case t if t > 25.0:
                return Fan.ON
            case _:
                return Fan.OFF

    def callback(self, msg):
        new = self.decide(msg.data)
        if new is not self.fan:
            self.status.publish(String(data=f'fan {self.fan.name} -> {new.name}'))
        self.fan = new
        self.running.publish(Bool(data=self.fan is Fan.ON))
        self.speed.publish(Float32(data=float(self.fan)))


def main(args=None):
    rclpy.init(args=args)
    n = fan_controller()
    rclpy.spin(n)


if __name__ == '__main__':
    main()
