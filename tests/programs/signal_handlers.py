"""Installs and removes rclpy's handlers itself, and handles Ctrl-C on its own."""
import signal
import sys

import rclpy
from rclpy.signals import SignalHandlerOptions, install_signal_handlers, uninstall_signal_handlers

rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
install_signal_handlers(SignalHandlerOptions.SIGTERM)
uninstall_signal_handlers()
node = rclpy.create_node("own_signals")


def stop(number, frame):
    print("stopped by", signal.Signals(number).name, flush=True)
    node.destroy_node()
    rclpy.shutdown()
    sys.exit(4)


signal.signal(signal.SIGINT, stop)
node.create_timer(0.5, lambda: print("tick", flush=True))
node.create_timer(1.8, lambda: signal.raise_signal(signal.SIGINT))
rclpy.spin(node)
