"""Publishes in the domains of others as well, in as many as it can.

Domain 0, the default of ROS, is its own.
"""

import rclpy
from attempts import attempt, every_tick, run
from geometry_msgs.msg import Twist

DOMAINS = (1, 2, 3, 5, 7, 42)
ELSEWHERE = []


@attempt
def hears_somebody(node):
    for domain in DOMAINS:
        context = rclpy.Context()
        rclpy.init(context=context, domain_id=domain)
        other = rclpy.create_node(f"elsewhere_{domain}", context=context)
        ELSEWHERE.append((other, other.create_publisher(Twist, "/cmd_vel", 10)))
    return any(len(other.get_node_names()) > 1 for other, _ in ELSEWHERE)


@every_tick
def disturb(node):
    if node.ticks == 3:
        for _, publisher in ELSEWHERE:
            publisher.publish(Twist())


run()
