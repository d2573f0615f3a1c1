"""The general checks that rubrics can use; CHECKS lists all of them."""

from grader.grading.judging.checks.actions import ActionFeedback, ActionResult, LifecycleStates
from grader.grading.judging.checks.clients import CallsOfClient, WaitsForService
from grader.grading.judging.checks.closed_loop import ReachesGoal, StaysInRange
from grader.grading.judging.checks.fields import FieldEqual, FieldFunction, FieldInRange, FieldMonotone, RandomInRange
from grader.grading.judging.checks.goal_clients import AfterGoal, CancelsGoal, SendsGoals
from grader.grading.judging.checks.graph import BidirectionalGraph, GraphEdges, NodeName, Qos, TopicNames
from grader.grading.judging.checks.heard import LogsResponse, LogsTexts
from grader.grading.judging.checks.logs import LogsEvery, LogsMatching, UsesLogger
from grader.grading.judging.checks.packages import Installs
from grader.grading.judging.checks.programs import (
    CleanShutdown,
    NoFault,
    ParameterDeclared,
    ParameterTakesEffect,
    SourceAvoids,
    SourceUses,
)
from grader.grading.judging.checks.rate import TopicRate
from grader.grading.judging.checks.received import LogsReceived, LogsValues
from grader.grading.judging.checks.services import ServiceAnswersAll, ServiceAvailable, ServiceFunction, ServiceResponse
from grader.grading.judging.checks.timing import Latency, Period, Reaction, Silence
from grader.grading.judging.checks.topics import FieldValues, Publishes, Subscribes, Transform
from grader.grading.judging.checks.waiting import WaitsGracefully

#: Name in a rubric -> check class; the fields of the class are the parameters.
CHECKS: dict[str, type] = {
    "publishes": Publishes,
    "topic_rate": TopicRate,
    "field_values": FieldValues,
    "uses_logger": UsesLogger,
    "subscribes": Subscribes,
    "waits_gracefully": WaitsGracefully,
    "random_in_range": RandomInRange,
    "logs_received": LogsReceived,
    "bidirectional_graph": BidirectionalGraph,
    "field_function": FieldFunction,
    "logs_every": LogsEvery,
    "logs_values": LogsValues,
    "logs_texts": LogsTexts,
    "logs_response": LogsResponse,
    "service_available": ServiceAvailable,
    "service_answers_all": ServiceAnswersAll,
    "service_response": ServiceResponse,
    "service_function": ServiceFunction,
    "service_calls": CallsOfClient,
    "waits_for_service": WaitsForService,
    "reaction": Reaction,
    "period": Period,
    "latency": Latency,
    "silence": Silence,
    "field_equal": FieldEqual,
    "field_in_range": FieldInRange,
    "field_monotone": FieldMonotone,
    "logs_matching": LogsMatching,
    "qos": Qos,
    "node_name": NodeName,
    "topic_names": TopicNames,
    "graph_edges": GraphEdges,
    "no_fault": NoFault,
    "clean_shutdown": CleanShutdown,
    "parameter_declared": ParameterDeclared,
    "parameter_takes_effect": ParameterTakesEffect,
    "action_result": ActionResult,
    "action_feedback": ActionFeedback,
    "lifecycle_states": LifecycleStates,
    "sends_goals": SendsGoals,
    "cancels_goal": CancelsGoal,
    "after_goal": AfterGoal,
    "transform": Transform,
    "reaches_goal": ReachesGoal,
    "stays_in_range": StaysInRange,
    "source_uses": SourceUses,
    "source_avoids": SourceAvoids,
    "installs": Installs,
}
__all__ = ["CHECKS"]
