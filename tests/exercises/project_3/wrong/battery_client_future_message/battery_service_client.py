import time
import rclpy
from rclpy.node import Node
from std_srvs.srv import Trigger


class BatteryServiceClient(Node):
    def __init__(self):
        super().__init__('battery_service_client')
        self.client = self.create_client(Trigger, 'battery/get_status')
        while not self.client.wait_for_service(timeout_sec=1.0):
            self.get_logger().info('Service not available, waiting...')

    def call_service(self):
        return self.client.call_async(Trigger.Request())


def main(args=None):
    rclpy.init(args=args)
    client = BatteryServiceClient()
    for i in range(5):
        result = client.call_service()
        rclpy.spin_once(client, timeout_sec=0.5)
        battery = float(result.message.split(':')[1].split('%')[0])
        if battery > 20:
            client.get_logger().info('Mission can start')
        else:
            client.get_logger().warn('Battery too low')
        time.sleep(1)
    client.destroy_node()
    rclpy.shutdown()


if __name__ == '__main__':
    main()
