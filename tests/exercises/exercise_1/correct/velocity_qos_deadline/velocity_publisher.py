import rclpy
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.qos import (DurabilityPolicy, HistoryPolicy, LivelinessPolicy, QoSProfile, ReliabilityPolicy)
from geometry_msgs.msg import Twist

QOS = QoSProfile(
    history=HistoryPolicy.KEEP_LAST,
    depth=1,
    reliability=ReliabilityPolicy.RELIABLE,
    durability=DurabilityPolicy.VOLATILE,
    deadline=Duration(seconds=0.1),
    lifespan=Duration(seconds=1),
    liveliness=LivelinessPolicy.MANUAL_BY_TOPIC,
    liveliness_lease_duration=Duration(seconds=0.5),
)


class VelocityPublisher(Node):
    def __init__(self):
        super().__init__('velocity_publisher')
        self.pub = self.create_publisher(Twist, '/cmd_vel', QOS)
        self.create_timer(0.05, self.tick)
        self.get_logger().info('QoS: %s' % QOS)

    def tick(self):
        m = Twist()
        m.linear.x = 0.5
        m.angular.z = 0.1
        self.pub.publish(m)


def main():
    rclpy.init()
    rclpy.spin(VelocityPublisher())


if __name__ == '__main__':
    main()
