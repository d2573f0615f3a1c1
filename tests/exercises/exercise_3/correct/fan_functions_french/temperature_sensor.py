import random
import rclpy
from std_msgs.msg import Float32, Int16

noeud = None
editeur = None


def mesurer():
    t = Float32()
    t.data = 20 + 10 * random.random()
    print(f'température : {t.data:.1f} °C')
    editeur.publish(t)


def vitesse(message):
    noeud.get_logger().info(f'vitesse du ventilateur reçue : {message.data}')


def main():
    global noeud, editeur
    rclpy.init()
    noeud = rclpy.create_node('capteur')
    editeur = noeud.create_publisher(Float32, '/temperature', 10)
    noeud.create_subscription(Int16, '/fan_speed', vitesse, 10)
    noeud.create_timer(0.2, mesurer)
    rclpy.spin(noeud)


if __name__ == '__main__':
    main()
