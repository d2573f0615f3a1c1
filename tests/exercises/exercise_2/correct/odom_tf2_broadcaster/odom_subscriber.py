import rclpy
from geometry_msgs.msg import TransformStamped
from nav_msgs.msg import Odometry
from rclpy.node import Node
from rclpy.time import Time
from tf2_ros import Buffer, TransformBroadcaster, TransformException, TransformListener


class OdomSubscriber(Node):
    def __init__(self):
        super().__init__('odom_subscriber')
        self.broadcaster = TransformBroadcaster(self)
        self.buffer = Buffer()
        self.listener = TransformListener(self.buffer, self)
        self.create_subscription(Odometry, '/odom', self.on_odometry, 10)
        self.create_timer(1.0, self.show)

    def on_odometry(self, msg):
        frame = TransformStamped()
        frame.header.stamp = self.get_clock().now().to_msg()
        frame.header.frame_id, frame.child_frame_id = 'odom', 'base_link'
        frame.transform.translation.x = msg.pose.pose.position.x
        frame.transform.translation.y = msg.pose.pose.position.y
        frame.transform.rotation = msg.pose.pose.orientation
        self.broadcaster.sendTransform(frame)

    def show(self):
        try:
            place = self.buffer.lookup_transform('odom', 'base_link', Time()).transform.translation
        except TransformException:
            self.get_logger().info('waiting for odometry')
            return
        self.get_logger().info(f'x={place.x:.2f} y={place.y:.2f}')


def main(args=None):
    rclpy.init(args=args)
    rclpy.spin(OdomSubscriber())


if __name__ == '__main__':
    main()
