import rclpy
from rclpy.node import Node
from rclpy.qos import QoSPresetProfiles
from geometry_msgs.msg import Twist


class velocityPublisher(Node):
    def __init__(self):
        super().__init__("velocity_publisher_node")
        qos = QoSPresetProfiles.get_from_short_key('system_default')
        self.velPub = self.create_publisher(Twist, "cmd_vel", qos)
        self.Timer = self.create_timer(0.05, self.velPubCallback)
        self.get_logger().info("Velocity publisher node has been started!!!")

    def velPubCallback(self):
        velMsg = Twist()
        velMsg.linear.x = 0.5
        velMsg.linear.y = 0.0
        velMsg.linear.z = 0.0
        velMsg.angular.x = 0.0
        velMsg.angular.y = 0.0
        velMsg.angular.z = 0.1
        self.velPub.publish(velMsg)


def main(args=None):
    rclpy.init(args=args)
    node = velocityPublisher()
    rclpy.spin(node)
    rclpy.shutdown()


if __name__ == "__main__":
    main()
