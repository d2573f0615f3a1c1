from geometry_msgs.msg import Twist

SPEED = 0.5
TURN = 0.1


def circle_command():
    twist = Twist()
    twist.linear.x = SPEED
    twist.angular.z = TURN
    return twist
