"""One of every check, as a rubric might ask it."""

from __future__ import annotations

from tracing import ODOMETRY, TRIGGER, TWIST

from grader.grading.judging.checks.graph import GraphEdge
from grader.grading.judging.checks.timing import ReactionCase
from grader.grading.judging.values import FieldRule
from grader.grading.model.exercise import Check
from grader.grading.rubrics.exercise_checks import known_checks
from grader.runtime.model.quantities import NS_PER_S

CHECKS = known_checks()

INSTANCES: dict[str, Check] = {
    "publishes": CHECKS["publishes"]("/cmd_vel", TWIST),
    "topic_rate": CHECKS["topic_rate"]("/cmd_vel", 20.0, 1.0, 10 * NS_PER_S, 2.0),
    "field_values": CHECKS["field_values"]("/cmd_vel", {"linear.x": 0.5, "angular.z": 0.1}),
    "uses_logger": CHECKS["uses_logger"]("velocity_publisher.py"),
    "subscribes": CHECKS["subscribes"]("/odom", ODOMETRY),
    "logs_position": CHECKS["logs_position"]("odom_subscriber.py", "/odom"),
    "log_period": CHECKS["log_period"]("odom_subscriber.py", "/odom", NS_PER_S),
    "waits_gracefully": CHECKS["waits_gracefully"]("odom_subscriber.py", "/odom", 5 * NS_PER_S),
    "random_in_range": CHECKS["random_in_range"]("/temperature", 20, 30),
    "logs_received": CHECKS["logs_received"]("temperature_sensor.py", "/fan_speed"),
    "threshold_response": CHECKS["threshold_response"]("/temperature", "/fan_speed", 25, 100, 0, "above"),
    "answers_together": CHECKS["answers_together"]("/temperature", "/fan_speed", 25, 100, 0),
    "bidirectional_graph": CHECKS["bidirectional_graph"]("/temperature", "/fan_speed"),
    "field_function": CHECKS["field_function"]("/joint_commands", "sin(0.1 * n)"),
    "logs_every": CHECKS["logs_every"]("velocity_publisher.py", "/cmd_vel", 20, "linear.x"),
    "logs_values": CHECKS["logs_values"]("temperature_sensor.py", "/fan_speed", unit_factors=(1.0, 2.0)),
    "logs_texts": CHECKS["logs_texts"]("velocity_publisher.py", "/chatter"),
    "logs_response": CHECKS["logs_response"]("battery_service_client.py", "/battery/get_status", "message"),
    "service_available": CHECKS["service_available"]("/battery/get_status", TRIGGER),
    "service_answers_all": CHECKS["service_answers_all"]("/battery/get_status"),
    "service_response": CHECKS["service_response"](
        "/battery/get_status", {"success": True, "message": FieldRule(pattern="Battery: .*")}
    ),
    "service_function": CHECKS["service_function"]("/add_two_ints", "sum", "a + b"),
    "service_sequence": CHECKS["service_sequence"]("/battery/get_status", 84.5, -0.5, floor=0.0, reset_to=100.0),
    "service_calls": CHECKS["service_calls"]("/battery/get_status", 5, period=NS_PER_S),
    "waits_for_service": CHECKS["waits_for_service"]("battery_service_client.py", "/battery/get_status"),
    "reacts_to_responses": CHECKS["reacts_to_responses"]("battery_service_client.py", "/battery/get_status", 20.0),
    "no_go_without_answer": CHECKS["no_go_without_answer"]("battery_service_client.py", "/battery/get_status", 20.0),
    "reaction": CHECKS["reaction"](
        "/temperature", "/fan_speed", (ReactionCase({"data": FieldRule(low=0)}, {"data": 100}),)
    ),
    "period": CHECKS["period"]("/cmd_vel", least=NS_PER_S // 100, average=NS_PER_S // 20),
    "latency": CHECKS["latency"]("/temperature", "/fan_speed", NS_PER_S),
    "silence": CHECKS["silence"]("/cmd_vel", after="stream_stops"),
    "field_equal": CHECKS["field_equal"]("/cmd_vel", {"linear.x": 0.5}),
    "field_in_range": CHECKS["field_in_range"]("/temperature", 20, 30),
    "field_monotone": CHECKS["field_monotone"]("/temperature"),
    "logs_matching": CHECKS["logs_matching"]("velocity_publisher.py", "start", "INFO"),
    "qos": CHECKS["qos"]("/cmd_vel", "publisher", "reliable"),
    "node_name": CHECKS["node_name"]("/velocity_publisher"),
    "topic_names": CHECKS["topic_names"](("/cmd_vel",)),
    "graph_edges": CHECKS["graph_edges"]((GraphEdge("/temperature"),)),
    "no_fault": CHECKS["no_fault"](),
    "clean_shutdown": CHECKS["clean_shutdown"]("velocity_publisher.py"),
    "parameter_declared": CHECKS["parameter_declared"]("speed", value=0.5),
    "parameter_takes_effect": CHECKS["parameter_takes_effect"]("speed", "/cmd_vel", field="linear.x"),
    "action_result": CHECKS["action_result"]("/fibonacci"),
    "action_feedback": CHECKS["action_feedback"]("/fibonacci"),
    "sends_goals": CHECKS["sends_goals"]("/count", ({"order": 5},), at_most=2),
    "cancels_goal": CHECKS["cancels_goal"]("/count", {"sequence[0]": 3}),
    "after_goal": CHECKS["after_goal"]("/count", "rejected", "same"),
    "lifecycle_states": CHECKS["lifecycle_states"](topic="/cmd_vel"),
    "transform": CHECKS["transform"]("odom", "base_link"),
    "reaches_goal": CHECKS["reaches_goal"]("/odom", "/goal", {"pose.pose.position.x": "x"}, 0.1, 5 * NS_PER_S),
    "stays_in_range": CHECKS["stays_in_range"]("/temperature", field="data", low=0.0, high=40.0),
    "source_uses": CHECKS["source_uses"]("velocity_publisher.py", ("rclpy.node.Node",)),
    "installs": CHECKS["installs"](),
    "source_avoids": CHECKS["source_avoids"]("velocity_publisher.py", ("time.sleep",)),
}
