import rclpy
from rclpy.node import Node
from geometry_msgs.msg import PoseStamped, Twist


class VelocityPublisher(Node):
    def __init__(self):
        super().__init__('velocity_publisher')
        self.goal = None
        self.pub = self.create_publisher(Twist, '/cmd_vel', 10)
        self.create_subscription(PoseStamped, '/goal_pose', self.on_goal, 10)
        self.create_timer(0.05, self.tick)
        self.get_logger().info('waiting for a goal')

    def on_goal(self, msg):
        self.goal = msg

    def tick(self):
        if self.goal is None:
            return
        cmd = Twist()
        cmd.linear.x = 0.5
        cmd.angular.z = 0.1
        self.pub.publish(cmd)


def main():
    rclpy.init()
    rclpy.spin(VelocityPublisher())


if __name__ == '__main__':
    main()
