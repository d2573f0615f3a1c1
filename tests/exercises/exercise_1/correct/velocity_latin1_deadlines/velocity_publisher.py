# -*- coding: latin-1 -*-
# Ejercicio 1 - la velocidad del robot móvil
import time

import rclpy
from geometry_msgs.msg import Twist
from rclpy.node import Node


def principal():
    rclpy.init()
    nodo = Node('publicador')
    publicador = nodo.create_publisher(Twist, '/cmd_vel', 10)
    mensaje = Twist()
    mensaje.linear.x = 0.5
    mensaje.angular.z = 0.1
    siguiente = time.monotonic()
    while rclpy.ok():
        publicador.publish(mensaje)
        nodo.get_logger().info('publicación en marcha: ¡cuidado!', once=True)
        siguiente += 0.05
        time.sleep(max(0.0, siguiente - time.monotonic()))


if __name__ == "__main__":
    principal()
