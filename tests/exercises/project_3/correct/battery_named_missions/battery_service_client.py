import time

import rclpy
from std_srvs.srv import Trigger

MISSIONS = ["survey the field", "water the plants", "fetch the mail", "patrol", "return to base"]


def main():
    rclpy.init()
    node = rclpy.create_node("planner")
    client = node.create_client(Trigger, "/battery/get_status")
    while not client.wait_for_service(timeout_sec=1.0):
        node.get_logger().info("waiting for the battery service")
    for place, mission in enumerate(MISSIONS):
        future = client.call_async(Trigger.Request())
        rclpy.spin_until_future_complete(node, future, timeout_sec=4.0)
        response = future.result()
        try:
            percent = float(response.message.partition(":")[2].partition("%")[0]) if response.success else None
        except (AttributeError, ValueError):
            percent = None
        if percent is None:
            node.get_logger().error(f"cannot {mission}: the charge is unknown")
        elif percent > 20.0:
            node.get_logger().info(f"{percent} %: off to {mission}")
        else:
            node.get_logger().warning(f"{percent} %: will not {mission}")
        if place < len(MISSIONS) - 1:
            node.get_logger().info("next question in a second")
            time.sleep(1.0)
    node.destroy_node()
    rclpy.shutdown()


if __name__ == "__main__":
    main()
