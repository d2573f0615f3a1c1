"""Uses contexts and executors with `with`, one after the other, and then as newer releases would allow."""
import rclpy
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.signals import SignalHandlerOptions, get_current_signal_handlers_options

for number in range(2):
    with Context() as context, SingleThreadedExecutor(context=context) as executor:
        node = rclpy.create_node(f"number_{number}", context=context)
        executor.add_node(node)
        node.create_timer(0.3, lambda: print("tick", flush=True))
        for _ in range(2):
            executor.spin_once(timeout_sec=0.5)
    print(context.ok(), flush=True)
with rclpy.init(signal_handler_options=SignalHandlerOptions.NO):
    print(get_current_signal_handlers_options().name, flush=True)
