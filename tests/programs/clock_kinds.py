"""Compares the kinds of clocks."""
import time

import rclpy
from rclpy.clock import Clock, ClockType
from rclpy.duration import Duration

rclpy.init()
node = rclpy.create_node("kinds")
for kind in (ClockType.SYSTEM_TIME, ClockType.STEADY_TIME, ClockType.ROS_TIME):
    clock = Clock(clock_type=kind)
    before = clock.now()
    clock.sleep_for(Duration(seconds=0.3))
    passed = clock.now() - before
    print(kind.name, before.clock_type.name, round(passed.nanoseconds / 1e9, 1), flush=True)
system = Clock(clock_type=ClockType.SYSTEM_TIME).now()
print(abs(system.nanoseconds / 1e9 - time.time()) < 1, flush=True)
try:
    print(system < Clock(clock_type=ClockType.STEADY_TIME).now())
except TypeError as error:
    print(error)
