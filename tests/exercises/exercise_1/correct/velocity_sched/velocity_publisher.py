import sched
import time
import rclpy
from geometry_msgs.msg import Twist

plan = sched.scheduler(time.monotonic, time.sleep)


def publish(node, pub, due):
    if not rclpy.ok():
        return
    pub.publish(Twist(linear=vec(x=0.5), angular=vec(z=0.1)))
    node.get_logger().info('published', skip_first=True, throttle_duration_sec=1.0)
    plan.enterabs(due + 0.05, 1, publish, (node, pub, due + 0.05))


def vec(**kw):
    from geometry_msgs.msg import Vector3
    return Vector3(**kw)


if __name__ == '__main__':
    rclpy.init()
    node = rclpy.create_node('planned')
    pub = node.create_publisher(Twist, '/cmd_vel', 10)
    start = time.monotonic() + 0.5
    plan.enterabs(start, 1, publish, (node, pub, start))
    plan.run()
