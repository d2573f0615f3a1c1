"""The general checks that rubrics can use; CHECKS lists all of them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from importlib import import_module

#: Name in a rubric -> module in this folder and class; the fields of the class are the parameters.
_PLACES = {
    "publishes": ("topics", "Publishes"),
    "topic_rate": ("rate", "TopicRate"),
    "field_values": ("topics", "FieldValues"),
    "uses_logger": ("logs", "UsesLogger"),
    "subscribes": ("topics", "Subscribes"),
    "waits_gracefully": ("waiting", "WaitsGracefully"),
    "random_in_range": ("fields", "RandomInRange"),
    "logs_received": ("received", "LogsReceived"),
    "bidirectional_graph": ("graph", "BidirectionalGraph"),
    "field_function": ("fields", "FieldFunction"),
    "logs_every": ("logs", "LogsEvery"),
    "logs_values": ("received", "LogsValues"),
    "logs_texts": ("heard", "LogsTexts"),
    "logs_response": ("heard", "LogsResponse"),
    "service_available": ("services", "ServiceAvailable"),
    "service_answers_all": ("services", "ServiceAnswersAll"),
    "service_response": ("services", "ServiceResponse"),
    "service_function": ("services", "ServiceFunction"),
    "service_calls": ("clients", "CallsOfClient"),
    "waits_for_service": ("clients", "WaitsForService"),
    "reaction": ("timing", "Reaction"),
    "period": ("timing", "Period"),
    "latency": ("timing", "Latency"),
    "silence": ("timing", "Silence"),
    "field_equal": ("fields", "FieldEqual"),
    "field_in_range": ("fields", "FieldInRange"),
    "field_monotone": ("fields", "FieldMonotone"),
    "logs_matching": ("logs", "LogsMatching"),
    "qos": ("graph", "Qos"),
    "node_name": ("graph", "NodeName"),
    "topic_names": ("graph", "TopicNames"),
    "graph_edges": ("graph", "GraphEdges"),
    "no_fault": ("programs", "NoFault"),
    "clean_shutdown": ("programs", "CleanShutdown"),
    "parameter_declared": ("programs", "ParameterDeclared"),
    "parameter_takes_effect": ("programs", "ParameterTakesEffect"),
    "action_result": ("actions", "ActionResult"),
    "action_feedback": ("actions", "ActionFeedback"),
    "lifecycle_states": ("actions", "LifecycleStates"),
    "sends_goals": ("goal_clients", "SendsGoals"),
    "cancels_goal": ("goal_clients", "CancelsGoal"),
    "after_goal": ("goal_clients", "AfterGoal"),
    "transform": ("topics", "Transform"),
    "reaches_goal": ("closed_loop", "ReachesGoal"),
    "stays_in_range": ("closed_loop", "StaysInRange"),
    "source_uses": ("programs", "SourceUses"),
    "source_avoids": ("programs", "SourceAvoids"),
    "installs": ("packages", "Installs"),
}


class _Checks(Mapping[str, type]):
    """The check classes by their names in rubrics; the module of one is imported when it is first asked for."""

    def __getitem__(self, name: str) -> type:
        module, kind = _PLACES[name]
        check: type = getattr(import_module(f"{__name__}.{module}"), kind)
        return check

    def __iter__(self) -> Iterator[str]:
        return iter(_PLACES)

    def __len__(self) -> int:
        return len(_PLACES)

    def __contains__(self, name: object) -> bool:
        return name in _PLACES


CHECKS: Mapping[str, type] = _Checks()
#: The checks that cannot judge a recording that a student has handed in: name -> what they ask that no recording holds.
NOT_IN_BAGS: Mapping[str, str] = {
    **dict.fromkeys(
        (
            "uses_logger",
            "waits_gracefully",
            "logs_received",
            "logs_every",
            "logs_values",
            "logs_texts",
            "logs_response",
            "logs_matching",
        ),
        "what programs log",
    ),
    **dict.fromkeys(
        ("subscribes", "bidirectional_graph", "qos", "node_name", "topic_names", "graph_edges"), "the graph of nodes"
    ),
    **dict.fromkeys(
        (
            "service_available",
            "service_answers_all",
            "service_response",
            "service_function",
            "service_calls",
            "waits_for_service",
            "lifecycle_states",
        ),
        "calls of services",
    ),
    **dict.fromkeys(("action_result", "action_feedback", "sends_goals", "cancels_goal", "after_goal"), "goals"),
    **dict.fromkeys(("no_fault", "clean_shutdown"), "how programs end"),
    **dict.fromkeys(("parameter_declared", "parameter_takes_effect"), "parameters of nodes"),
    **dict.fromkeys(("source_uses", "source_avoids"), "the text of programs"),
    "installs": "packages",
}
__all__ = ["CHECKS", "NOT_IN_BAGS"]
