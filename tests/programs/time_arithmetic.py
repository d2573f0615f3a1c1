"""Calculates with times and durations, and turns them into messages."""
import rclpy
from rclpy.duration import Duration, Infinite
from rclpy.time import Time

rclpy.init()
node = rclpy.create_node("calculates")
start = Time(seconds=10, nanoseconds=500_000_000)
later = start + Duration(seconds=2.75)
print(later.seconds_nanoseconds(), (later - start).nanoseconds, later > start)
print(later.to_msg().sec, Time.from_msg(later.to_msg()).nanoseconds == later.nanoseconds)
print(Duration(seconds=-1.5).nanoseconds, Duration.from_msg(Duration(seconds=3).to_msg()) == Duration(seconds=3))
print(Duration(seconds=1) * 3 == Duration(seconds=3) if hasattr(Duration, "__mul__") else "no product")
print(Infinite.nanoseconds > 0, Duration(nanoseconds=5) < Duration(seconds=1))
for wrong in ({"seconds": -1}, {"nanoseconds": 2**70}):
    try:
        Time(**wrong)
    except (ValueError, OverflowError) as error:
        print(type(error).__name__)
print(start - Duration(seconds=20))
