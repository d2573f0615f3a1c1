import rclpy
from rclpy.node import Node
from geometry_msgs.msg import Twist

class VelNode(Node):
    def __init__(self, name='vel_node', topic='cmd_vel'):
        Node.__init__(self, name)
        self.pub = self.create_publisher(Twist, topic, 10)
        self.twist = Twist()
        self.twist.linear.x, self.twist.angular.z = 0.5, 0.1

    def run(self):
        # the timeout is the pause between two commands
        while rclpy.ok():
            self.pub.publish(self.twist)
            self.get_logger().debug('tick')
            rclpy.spin_once(self, timeout_sec=0.05)

if __name__ == '__main__':
    rclpy.init()
    node = VelNode()
    node.get_logger().warn('robot starts moving!')
    node.run()
    rclpy.shutdown()
