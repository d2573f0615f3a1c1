"""Sleeps with a rate in a thread, until the rate is destroyed."""
import threading

import rclpy
from rclpy.exceptions import ROSInterruptException

rclpy.init()
node = rclpy.create_node("rate")
rate = node.create_rate(4, node.get_clock())


def work():
    turns = 0
    try:
        while True:
            rate.sleep()
            turns += 1
            print("turn", turns, flush=True)
            if turns == 3:
                node.destroy_rate(rate)
    except (ROSInterruptException, RuntimeError) as error:
        print("over:", type(error).__name__, flush=True)


thread = threading.Thread(target=work)
thread.start()
while thread.is_alive():
    rclpy.spin_once(node, timeout_sec=0.1)
print("end")
