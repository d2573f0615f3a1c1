import re
import time

import rclpy
from rclpy.node import Node
from std_srvs.srv import Trigger


class Planner(Node):
    """Asks again up to two times where there is no charge in the answer, half a second later."""

    def __init__(self):
        super().__init__("planner")
        self.client = self.create_client(Trigger, "battery/get_status")
        while rclpy.ok() and not self.client.wait_for_service(timeout_sec=0.5):
            self.get_logger().warning("battery service not available, trying again")

    def charge(self):
        for attempt in range(1, 4):
            future = self.client.call_async(Trigger.Request())
            rclpy.spin_until_future_complete(self, future, timeout_sec=1.0)
            answer = future.result() if future.done() else None
            if answer is not None and answer.success:
                found = re.match(r"Battery: ([\d.]+)% remaining", answer.message)
                if found:
                    return float(found.group(1))
            self.get_logger().error(f"attempt {attempt} gave no charge")
            time.sleep(0.5)
        return None


def main():
    rclpy.init()
    planner = Planner()
    log = planner.get_logger()
    for mission in range(5):
        charge = planner.charge()
        if charge is None:
            log.error("mission cancelled: charge unknown")
            continue
        if charge <= 20.0:
            log.warning(f"mission cancelled: {charge:.0f} % is not enough")
        else:
            log.info(f"mission under way with {charge:.2f} %")
        time.sleep(1.0)
    rclpy.shutdown()


if __name__ == "__main__":
    main()
