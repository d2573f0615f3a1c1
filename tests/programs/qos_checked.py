"""Asks whether two profiles fit before it uses them."""
import rclpy
from rclpy.duration import Duration
from rclpy.qos import (
    QoSCompatibility,
    QoSPresetProfiles,
    QoSProfile,
    ReliabilityPolicy,
    qos_check_compatible,
    qos_profile_sensor_data,
    qos_profile_system_default,
)

rclpy.init()
node = rclpy.create_node("checker")
pairs = {
    "sensor to reliable": (qos_profile_sensor_data, QoSProfile(depth=1)),
    "reliable to sensor": (QoSProfile(depth=1), qos_profile_sensor_data),
    "deadline": (QoSProfile(depth=1), QoSProfile(depth=1, deadline=Duration(seconds=1))),
    "system default": (qos_profile_system_default, QoSProfile(depth=1)),
}
for name, (offered, wanted) in pairs.items():
    compatibility, reason = qos_check_compatible(offered, wanted)
    node.get_logger().info(f"{name}: {compatibility == QoSCompatibility.OK} {reason}")
node.get_logger().info(str(qos_profile_sensor_data == QoSPresetProfiles.SENSOR_DATA.value))
node.get_logger().info(QoSPresetProfiles.get_from_short_key("services_default").reliability.name)
try:
    QoSProfile(reliability=ReliabilityPolicy.RELIABLE)
except TypeError as error:
    node.get_logger().error(type(error).__name__)
