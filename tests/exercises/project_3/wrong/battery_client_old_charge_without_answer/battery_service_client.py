"""Asks for the charge of the battery five times, and decides each time whether a mission may start."""

import re
import time

import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from std_srvs.srv import Trigger

MISSIONS = 5
PAUSE_S = 1.0
LEAST_CHARGE = 20.0
ANSWER_WITHIN_S = 5.0
CHARGE = re.compile(r"Battery:\s*(\d+(?:\.\d+)?)\s*%")


class MissionPlanner(Node):
    """A client of /battery/get_status."""

    def __init__(self):
        super().__init__("mission_planner")
        self.client = self.create_client(Trigger, "/battery/get_status")
        self.last = None

    def wait_for_server(self):
        """Wait as long as it takes, and say so once a second."""
        while not self.client.wait_for_service(timeout_sec=1.0):
            self.get_logger().info("waiting for /battery/get_status")

    def charge(self):
        """Return the charge in percent, or None if there is no answer that says it."""
        future = self.client.call_async(Trigger.Request())
        rclpy.spin_until_future_complete(self, future, timeout_sec=ANSWER_WITHIN_S)
        response = future.result() if future.done() else None
        if response is None:
            self.client.remove_pending_request(future)
            return self.last
        found = CHARGE.search(response.message) if response.success else None
        self.last = float(found[1]) if found else None
        return self.last

    def decide(self, mission):
        """Ask, and log whether a mission may start."""
        charge = self.charge()
        if charge is None:
            self.get_logger().error(f"mission {mission}: aborted, the charge is not known")
        elif charge > LEAST_CHARGE:
            self.get_logger().info(f"mission {mission}: started with {charge:.1f}%")
        else:
            self.get_logger().warning(f"mission {mission}: aborted, only {charge:.1f}% left")


def main(args=None):
    """Decide five times, then end."""
    rclpy.init(args=args)
    node = MissionPlanner()
    try:
        node.wait_for_server()
        for mission in range(1, MISSIONS + 1):
            node.decide(mission)
            time.sleep(PAUSE_S)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        node.destroy_node()
        rclpy.try_shutdown()


if __name__ == "__main__":
    main()
