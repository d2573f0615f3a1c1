#!/usr/bin/env python3
import rospy
from geometry_msgs.msg import Twist

rospy.init_node('velocity_publisher')
pub = rospy.Publisher('/cmd_vel', Twist, queue_size=10)
rate = rospy.Rate(20)
msg = Twist()
msg.linear.x = 0.5
msg.angular.z = 0.1
while not rospy.is_shutdown():
    pub.publish(msg)
    rospy.loginfo('published')
    rate.sleep()
