"""Project 3: ask for the charge of a battery before each mission."""

import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node

# TODO: import the service type.


class MissionPlanner(Node):
    """A client of /battery/get_status."""

    def __init__(self):
        super().__init__("mission_planner")

        # TODO: create a client of /battery/get_status, type std_srvs/srv/Trigger.
        # TODO: wait until the service is there, as long as it takes, and log that you wait.


def main(args=None):
    rclpy.init(args=args)
    node = MissionPlanner()
    try:
        # TODO: ask 5 times, about 1 s apart, and read the percentage in the answer.
        # TODO: above 20 percent log that the mission starts; at 20 or below log a warning that it does not.
        # TODO: without an answer that tells the charge no mission starts.
        pass
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        node.destroy_node()
        rclpy.try_shutdown()


if __name__ == "__main__":
    main()
