import rclpy
from rclpy.clock import Clock, ClockType
from rclpy.node import Node
from nav_msgs.msg import Odometry


def main():
    rclpy.init()
    nodo = Node('suscriptor')
    ultimo = []
    nodo.create_subscription(Odometry, '/odom', lambda m: ultimo.append(m.pose.pose.position), 10)

    def informe():
        if not ultimo:
            nodo.get_logger().info('Esperando la odometría…')
            return
        p = ultimo[-1]
        ultimo[:] = [p]
        nodo.get_logger().info(f'Posición del robot: {round(p.x, 3), round(p.y, 3)} metros')

    nodo.create_timer(1.0, informe, clock=Clock(clock_type=ClockType.STEADY_TIME))
    rclpy.spin(nodo)


if __name__ == '__main__':
    main()
