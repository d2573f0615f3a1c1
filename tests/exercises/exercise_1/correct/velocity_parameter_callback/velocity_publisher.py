import rclpy
from rcl_interfaces.msg import ParameterDescriptor, FloatingPointRange, SetParametersResult
from rclpy.node import Node
from rclpy.parameter import Parameter
from geometry_msgs.msg import Twist


class VelocityPublisher(Node):
    def __init__(self):
        super().__init__('velocity_publisher')
        limits = FloatingPointRange(from_value=0.1, to_value=100.0, step=0.0)
        self.declare_parameters('cmd', [
            ('rate', 20.0, ParameterDescriptor(description='Hz', floating_point_range=[limits])),
            ('linear', 0.0),
            ('angular', 0.0),
        ])
        self.add_on_set_parameters_callback(self.changed)
        self.set_parameters([
            Parameter('cmd.linear', Parameter.Type.DOUBLE, 0.5),
            Parameter('cmd.angular', Parameter.Type.DOUBLE, 0.1),
        ])
        self.pub = self.create_publisher(Twist, '/cmd_vel', 10)
        self.timer = self.create_timer(1.0 / self.get_parameter('cmd.rate').get_parameter_value().double_value, self.tick)

    def changed(self, params):
        for p in params:
            self.get_logger().info('%s is now %s' % (p.name, p.value))
        return SetParametersResult(successful=True)

    def tick(self):
        out = Twist()
        out.linear.x = self.get_parameter('cmd.linear').value
        out.angular.z = self.get_parameter_or('cmd.angular', Parameter('x', value=9.0)).value
        self.pub.publish(out)


def main(args=None):
    rclpy.init(args=args)
    node = VelocityPublisher()
    try:
        rclpy.spin(node)
    except KeyboardInterrupt:
        node.get_logger().info('Keyboard interrupt')
    finally:
        node.destroy_node()
        rclpy.shutdown()


if __name__ == '__main__':
    main()
