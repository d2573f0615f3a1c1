#!/usr/bin/env python3
"""Blocks in call() on the main thread while another one spins; gives up for good at the first low charge."""
import sys
import threading
import time

import rclpy
from std_srvs.srv import Trigger


def percentage(text):
    try:
        return float(text.split()[1].rstrip("%"))
    except (IndexError, ValueError):
        return None


def main():
    rclpy.init()
    node = rclpy.create_node("mission_control")
    log = node.get_logger()
    client = node.create_client(Trigger, "/battery/get_status")
    threading.Thread(target=rclpy.spin, args=(node,), daemon=True).start()
    waited = 0
    while not client.wait_for_service(2.0):
        waited += 2
        log.info(f"still no server after {waited} s")
    for number in range(5):
        if number:
            time.sleep(1.0)
        reply = client.call(Trigger.Request())
        charge = percentage(reply.message) if reply.success else None
        if charge is None:
            log.error("I do not know the charge, no mission")
            continue
        if charge > 20:
            log.info(f"{charge}% is enough for mission {number + 1}")
        else:
            log.warning(f"only {charge}%, going home")
            sys.exit(0)
    log.info("all missions done")


if __name__ == "__main__":
    main()
