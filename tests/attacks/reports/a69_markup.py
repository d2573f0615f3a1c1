"""Puts elements and scripts of web pages into everything that a report shows. </script><img src=x onerror=attack69()>"""

import rclpy

MARKUP = '"><script>attack69()</script></script><img src=x onerror="attack69()"><svg/onload=attack69()>'


class Evil69Error(Exception):
    """</style><script>attack69()</script>"""


def main():
    rclpy.init()
    node = rclpy.create_node("velocity_publisher")
    node.get_logger().info(MARKUP)
    node.get_logger().error("</textarea><!--<script>attack69()//-->]]><iframe srcdoc='<script>attack69()</script>'>")
    print("javascript:attack69() {{7*7}} ${attack69()}", flush=True)
    raise Evil69Error(MARKUP)  # </script><script>attack69()</script>


main()
