"""Is told when the time jumps: it sets the time of a ROS clock itself."""
import rclpy
from rclpy.clock import ClockChange, JumpThreshold, ROSClock
from rclpy.duration import Duration
from rclpy.time import Time

rclpy.init()
node = rclpy.create_node("jumps")
clock = ROSClock()
print(clock.ros_time_is_active, clock.clock_type.name, flush=True)
threshold = JumpThreshold(
    min_forward=Duration(seconds=1), min_backward=Duration(seconds=-1), on_clock_change=True
)
handle = clock.create_jump_callback(
    threshold,
    pre_callback=lambda: print("about to jump", flush=True),
    post_callback=lambda jump: print("jumped", jump.clock_change.name, flush=True),
)
clock._set_ros_time_is_active(True)  # what a node does for use_sim_time
for seconds in (100, 100.5, 105, 50):
    clock.set_ros_time_override(Time(seconds=seconds, clock_type=clock.clock_type))
    print(clock.now().seconds_nanoseconds(), flush=True)
handle.unregister()
clock.set_ros_time_override(Time(seconds=500, clock_type=clock.clock_type))
print("quiet", ClockChange.ROS_TIME_ACTIVATED.name, flush=True)
