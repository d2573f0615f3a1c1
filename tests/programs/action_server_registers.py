"""Registers the callbacks of its server afterwards, and publishes feedback."""
import rclpy
from rclpy.action import ActionClient, ActionServer, GoalResponse
from rclpy.qos import QoSProfile
from test_msgs.action import Fibonacci

rclpy.init()
node = rclpy.create_node("registers")


def execute(handle):
    for number in range(handle.request.order):
        handle.publish_feedback(Fibonacci.Feedback(sequence=[number]))
    handle.succeed()
    return Fibonacci.Result(sequence=list(range(handle.request.order)))


server = ActionServer(node, Fibonacci, "act", lambda handle: None, feedback_pub_qos_profile=QoSProfile(depth=5))
server.register_execute_callback(execute)
server.register_goal_callback(lambda goal: GoalResponse.ACCEPT)
server.register_handle_accepted_callback(lambda handle: (print("go", flush=True), handle.execute()))
client = ActionClient(node, Fibonacci, "act", feedback_sub_qos_profile=QoSProfile(depth=5))
print(server.action_type.__name__, flush=True)


def start():
    timer.cancel()
    client.send_goal_async(
        Fibonacci.Goal(order=3), lambda message: print("at", list(message.feedback.sequence), flush=True)
    ).add_done_callback(lambda f: f.result().get_result_async().add_done_callback(lambda r: print(r.result().status, flush=True)))


timer = node.create_timer(0.5, start)
rclpy.spin(node)
