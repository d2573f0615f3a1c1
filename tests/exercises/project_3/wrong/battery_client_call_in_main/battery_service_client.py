import time

import rclpy
from std_srvs.srv import Trigger


def main():
    rclpy.init()
    node = rclpy.create_node('planificateur')
    client = node.create_client(Trigger, '/battery/get_status')
    while not client.wait_for_service(timeout_sec=1.0):
        node.get_logger().info('en attente du service')
    for mission in range(1, 6):
        reponse = client.call(Trigger.Request())
        pourcent = float(reponse.message[9:-11])
        if reponse.success and pourcent > 20:
            node.get_logger().info(f'mission {mission} : départ ({pourcent})')
        else:
            node.get_logger().warn(f'mission {mission} : annulée ({pourcent})')
        time.sleep(1)
    node.destroy_node()
    rclpy.shutdown()


if __name__ == '__main__':
    main()
