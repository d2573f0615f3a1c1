"""Adds and removes callbacks of a future, cancels one and gives one an exception."""
import rclpy
from rclpy.task import Future

rclpy.init()
node = rclpy.create_node("futures")
log = node.get_logger().info


def first(future):
    log(f"first {future.result()}")


def second(future):
    log("second")


one, two, three = Future(), Future(), Future()
one.add_done_callback(first)
one.add_done_callback(second)
log(f"{one.remove_done_callback(second)} {one.remove_done_callback(second)}")
two.add_done_callback(lambda future: log(f"cancelled {future.cancelled()} done {future.done()}"))
three.set_exception(ValueError("no result"))


def go():
    timer.cancel()
    one.set_result(42)
    two.cancel()
    try:
        three.result()
    except ValueError as error:
        log(f"{error}, {three.exception()!r}")


timer = node.create_timer(0.5, go)
rclpy.spin_until_future_complete(node, one, timeout_sec=2.0)
rclpy.spin_until_future_complete(node, two, timeout_sec=1.0)
