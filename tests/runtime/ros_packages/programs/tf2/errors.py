"""What a listener is told when something is missing: each exception by its class, as tutorials catch them."""

import rclpy
from geometry_msgs.msg import TransformStamped
from rclpy.time import Time
from tf2_ros import Buffer, ConnectivityException, ExtrapolationException, LookupException, TransformException

rclpy.init()
node = rclpy.create_node("fails")
buffer = Buffer()


def add(parent, child, seconds):
    t = TransformStamped()
    t.header.stamp.sec = seconds
    t.header.frame_id, t.child_frame_id = parent, child
    t.transform.rotation.w = 1.0
    buffer.set_transform(t, "me")


for seconds in (10, 12):
    add("odom", "base", seconds)
add("other", "thing", 10)

for target, source, time in (
    ("map", "base", Time()),
    ("odom", "thing", Time()),
    ("odom", "base", Time(seconds=20)),
    ("odom", "base", Time(seconds=1)),
    ("odom", "", Time()),
):
    try:
        buffer.lookup_transform(target, source, time)
    except LookupException as ex:
        node.get_logger().warning(f"lookup: {ex}")
    except ConnectivityException as ex:
        node.get_logger().warning(f"connectivity: {ex}")
    except ExtrapolationException as ex:
        node.get_logger().warning(f"extrapolation: {ex}")
    except TransformException as ex:
        node.get_logger().warning(f"{type(ex).__name__}: {ex}")
possible, why = buffer.can_transform("map", "base", Time(), return_debug_tuple=True)
node.get_logger().warning(f"{possible}: {why}")
rclpy.shutdown()

# logs: lookup: "map" passed to lookupTransform argument target_frame does not exist. 
# logs: connectivity: Could not find a connection between 'odom' and 'thing' because they are not part of the same tree.Tf has two or more unconnected trees.
# logs: extrapolation: Lookup would require extrapolation into the future.  Requested time 20.000000 but the latest data is at time 12.000000, when looking up transform from frame [base] to frame [odom]
# logs: extrapolation: Lookup would require extrapolation into the past.  Requested time 1.000000 but the earliest data is at time 10.000000, when looking up transform from frame [base] to frame [odom]
# logs: InvalidArgumentException: Invalid argument "" passed to lookupTransform argument source_frame - in tf2 frame_ids cannot be empty
# logs: False: Invalid frame ID "map" passed to canTransform argument target_frame - frame does not exist
