"""Speaks to the workflow that runs the grader, and to the terminal and the page that show what it says."""

import rclpy

COMMANDS = (
    "::set-output name=score::attack70", "::add-mask::attack70", "::error file=grader.py,line=1::attack70",
    "::stop-commands::attack70", "##[error]attack70", "::set-env name=PATH::attack70", "::add-path::attack70",
    "\r::warning::attack70", "\u2028::notice::attack70",
)
CONTROLS = "\x1b[2J\x1b]0;attack70\x07\x1b[31mattack70\x9b31m \u202eattack70\u2066 \x08\x08"


def main():
    rclpy.init()
    node = rclpy.create_node("velocity_publisher")
    for command in COMMANDS:
        node.get_logger().info(command)
        print(command, flush=True)
    node.get_logger().info(CONTROLS)
    raise RuntimeError("\n".join(COMMANDS) + CONTROLS + "\n| a | b |\n|---|---|\n```\n# attack70\n<details>")


main()
