import rclpy
from rclpy.node import Node
from std_msgs.msg import Float32, Int16

rclpy.init()
noeud = Node('ventilateur')
editeur = noeud.create_publisher(Int16, '/fan_speed', 10)
MARCHE, ARRET = Int16(data=100), Int16(data=0)
noeud.create_subscription(
    Float32, '/temperature', lambda t: editeur.publish(MARCHE if t.data > 25.0 else ARRET), 10)
while rclpy.ok():
    rclpy.spin_once(noeud)
