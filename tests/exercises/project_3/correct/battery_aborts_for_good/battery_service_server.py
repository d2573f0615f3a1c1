#!/usr/bin/env python3
"""A closure instead of a class; the charge is counted in calls."""
import rclpy
from std_srvs.srv import Trigger


def main():
    rclpy.init()
    node = rclpy.create_node("battery_monitor")
    calls = 0

    def answer(request: Trigger.Request, response: Trigger.Response) -> Trigger.Response:
        nonlocal calls
        calls += 1
        # 170 calls down to 0.0, then from 100.0 on in circles of 201
        left = 85.0 - 0.5 * calls if calls <= 170 else 100.0 - 0.5 * ((calls - 171) % 201)
        return Trigger.Response(success=True, message="Battery: {:.1f}% remaining".format(left))

    node.create_service(Trigger, "/battery/get_status", answer)
    rclpy.spin(node)


if __name__ == "__main__":
    main()
