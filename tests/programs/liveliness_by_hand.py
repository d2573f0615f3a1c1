"""A publisher that says itself that it is alive."""
import rclpy
from rclpy.duration import Duration
from rclpy.qos import LivelinessPolicy, QoSProfile
from std_msgs.msg import String

rclpy.init()
node = rclpy.create_node("alive")
qos = QoSProfile(depth=1, liveliness=LivelinessPolicy.MANUAL_BY_TOPIC, liveliness_lease_duration=Duration(seconds=5))
publisher = node.create_publisher(String, "alive", qos)
node.create_subscription(String, "alive", lambda message: print("heard", message.data, flush=True), qos)
turns = iter(range(1, 100))


def tick():
    turn = next(turns)
    if turn % 3 == 0:
        publisher.publish(String(data=str(turn)))
    else:
        publisher.assert_liveliness()


node.create_timer(0.3, tick)
rclpy.spin(node)
