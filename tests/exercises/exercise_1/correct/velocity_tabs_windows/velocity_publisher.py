#! /usr/bin/env python3
# -*- coding: utf-8 -*-
import rclpy, time, math
from rclpy.node import *
from geometry_msgs.msg import *

class vel_pub (Node) :
	def __init__ ( self ) :
		super ( vel_pub , self ).__init__ ( "vel_pub" )
		self.p = self.create_publisher ( Twist , "/cmd_vel" , 10 )
		self.t = self.create_timer ( 1.0/20 , self.cb )
		self.k = 0;

	def cb ( self ) :
		m = Twist ( ) ; m.linear.x = 0.5 ; m.angular.z = 0.1
		self.p.publish ( m )
		self.k = self.k + 1
		if ( self.k % 40 == 0 ) :
			self.get_logger ( ) . warning ( "v = %.1f m/s, w = %.1f rad/s" % ( m.linear.x , m.angular.z ) )

def main ( args = None ) :
	rclpy.init ( args = args )
	n = vel_pub ( )
	rclpy.spin ( n )
	n.destroy_node ( )
	rclpy.shutdown ( )

if ( __name__ == "__main__" ) :
	main ( )
