import rclpy
from geometry_msgs.msg import Twist
from rcl_interfaces.msg import SetParametersResult
from rclpy.node import Node
from rclpy.parameter import Parameter


class Driver(Node):
    def __init__(self):
        super().__init__(
            'driver',
            parameter_overrides=[Parameter('v', value=0.5), Parameter('w', value=0.1)],
            automatically_declare_parameters_from_overrides=True,
        )
        self.v = self.get_parameter('v').value
        self.w = self.get_parameter('w').value
        self.add_on_set_parameters_callback(self.changed)
        self.pub = self.create_publisher(Twist, '/cmd_vel', 10)
        self.create_timer(1 / 20, self.tick)

    def changed(self, params):
        for p in params:
            setattr(self, p.name, p.value)
        return SetParametersResult(successful=True)

    def tick(self):
        t = Twist()
        t.linear.x, t.angular.z = self.v, self.w
        self.pub.publish(t)
        self.get_logger().info(f'v={t.linear.x} w={t.angular.z}', throttle_duration_sec=2.0)


def main():
    rclpy.init()
    rclpy.spin(Driver())


if __name__ == '__main__':
    main()
