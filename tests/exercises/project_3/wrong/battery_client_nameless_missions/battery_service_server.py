import rclpy
from rclpy.node import Node
from std_srvs.srv import Trigger


class Battery(Node):
    def __init__(self):
        super().__init__('battery')
        self.srv = self.create_service(Trigger, '/battery/get_status', self.on_request)
        self.percent = 85.0
        self.get_logger().info('battery service ready')

    def on_request(self, request, response):
        self.percent -= 0.5
        if self.percent < 0:
            self.percent = 100.0
        response.success = True
        response.message = f'Battery: {self.percent:.1f}% remaining'
        self.get_logger().info(f'asked, {response.message}')
        return response


def main(args=None):
    rclpy.init(args=args)
    node = Battery()
    try:
        rclpy.spin(node)
    except KeyboardInterrupt:
        pass
    node.destroy_node()
    rclpy.shutdown()


if __name__ == '__main__':
    main()
