import time
import rclpy
from rclpy.node import Node
from std_srvs.srv import Trigger

SERVICE = 'get_status'


class CheckBattery(Node):
    def __init__(self):
        super().__init__('battery')
        self.cli = self.create_client(Trigger, SERVICE)
        while not self.cli.wait_for_service(1.0):
            self.get_logger().warn('el servicio no está disponible, esperando...')
        self.req = Trigger.Request()

    def enviar(self):
        self.future = self.cli.call_async(self.req)
        rclpy.spin_until_future_complete(self, self.future)
        return self.future.result()


def main():
    rclpy.init()
    nodo = CheckBattery()
    for _ in range(5):
        r = nodo.enviar()
        nivel = float(r.message.split(' ')[1].replace('%', ''))
        if r.success and nivel > 20:
            nodo.get_logger().info('misión iniciada')
        else:
            nodo.get_logger().warn('misión abortada')
        time.sleep(1)
    rclpy.shutdown()


if __name__ == '__main__':
    main()
