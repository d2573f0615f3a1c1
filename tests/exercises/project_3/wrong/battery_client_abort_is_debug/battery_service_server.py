import rclpy
from rclpy.node import Node
from std_srvs.srv import Trigger


class BatteryServer(Node):
    def __init__(self):
        super().__init__('battery_server')
        self.battery = 85.0
        self.create_service(Trigger, '/battery/get_status', self.callback)
        self.get_logger().info('battery server ready')

    def callback(self, request, response):
        self.battery -= 0.5
        if self.battery < 0:
            self.battery = 100.0
        response.success = True
        response.message = f'Battery: {self.battery:.1f}% remaining'
        return response


def main(args=None):
    rclpy.init(args=args)
    rclpy.spin(BatteryServer())


if __name__ == '__main__':
    main()
