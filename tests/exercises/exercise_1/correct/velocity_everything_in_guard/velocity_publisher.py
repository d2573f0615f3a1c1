if __name__ == '__main__':
    import atexit
    import rclpy
    from geometry_msgs.msg import Twist

    rclpy.init()
    nodes = {'drive': rclpy.create_node('drive'), 'say': rclpy.create_node('say')}
    pubs = [nodes['drive'].create_publisher(Twist, 'cmd_vel', 10)]
    atexit.register(lambda: print('done'))

    def send():
        global last
        last = Twist()
        last.linear.x, last.linear.y, last.angular.z = 0.5, 0.0, 0.1
        [p.publish(last) for p in pubs]

    nodes['drive'].create_timer(0.05, send)
    nodes['say'].create_timer(2.5, lambda: nodes['say'].get_logger().info(repr(last)))
    executor = rclpy.get_global_executor()
    for n in nodes.values():
        executor.add_node(n)
    while rclpy.ok():
        executor.spin_once()
