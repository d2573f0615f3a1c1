import rclpy
from temperature_sensor import FanController


def main():
    rclpy.init()
    rclpy.spin(FanController())


if __name__ == '__main__':
    main()
