"""Publishes a clock that runs four times as fast, and turns simulated time on."""

from attempts import attempt, every_tick, run
from rclpy.parameter import Parameter
from rosgraph_msgs.msg import Clock

STATE = {"clock": None}


@attempt
def becomes_the_clock(node):
    STATE["clock"] = node.create_publisher(Clock, "/clock", 10)
    node.set_parameters([Parameter("use_sim_time", value=True)])
    node.set_parameters([Parameter("use_sim_time", value=False)])
    return False


@every_tick
def warp(node):
    for step in range(8):
        clock = Clock()
        clock.clock.sec = 4 * node.ticks + step
        STATE["clock"].publish(clock)


run(rate_hz=5)
