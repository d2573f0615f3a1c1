import rclpy
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from std_msgs.msg import Float32, Int32


class FanController(Node):
    def __init__(self):
        super().__init__('fan_controller')
        latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self.speed = None
        self.pub = self.create_publisher(Int32, '/fan_speed', latched)
        self.sub = self.create_subscription(Float32, '/temperature', self.on_temperature, 10)

    def on_temperature(self, msg):
        speed = 100 if msg.data > 25.0 else 0
        if speed != self.speed:
            self.speed = speed
            self.pub.publish(Int32(data=speed))
            self.get_logger().warn(f'switching to {speed}')


def main(args=None):
    rclpy.init(args=args)
    rclpy.spin(FanController())


if __name__ == '__main__':
    main()
