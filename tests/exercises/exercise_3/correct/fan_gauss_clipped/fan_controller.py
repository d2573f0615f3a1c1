import rclpy
from rclpy.node import Node
from std_msgs.msg import Float64


class Fan(Node):
    def __init__(self):
        super().__init__('fan')
        self.t = 20.0
        self.out = self.create_publisher(Float64, '/fan_speed', 10)
        self.create_subscription(Float64, '/temperature', self.store, 10)
        self.create_timer(0.1, self.act)

    def store(self, msg):
        self.t = msg.data

    def act(self):
        m = Float64()
        m.data = 100.0 if self.t > 25.0 else 0.0
        self.out.publish(m)


def main():
    rclpy.init()
    rclpy.spin(Fan())


if __name__ == '__main__':
    main()
