"""What the checks and hint rules that come with the grader are written with, too; it may change between versions.

    from grader.api.unstable import last_name, reached

Most of it reads students' source code. What you write with these names may need an edit after an update, and the
release notes do not list it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from grader.api.lazily import homes, look_up

if TYPE_CHECKING:
    from grader.grading.judging.charts import Lanes as Lanes
    from grader.grading.judging.charts import compared_panels as compared_panels
    from grader.grading.judging.charts import drawn_case as drawn_case
    from grader.grading.judging.charts import gaps_panel as gaps_panel
    from grader.grading.judging.charts import series as series
    from grader.grading.judging.charts import time_chart as time_chart
    from grader.grading.judging.checks.services import too_few_responses as too_few_responses
    from grader.grading.judging.diagnosis.rules import Maker as Maker
    from grader.grading.judging.diagnosis.rules import log_call as log_call
    from grader.grading.judging.diagnosis.rules import silent_topic as silent_topic
    from grader.grading.judging.diagnosis.values import draws as draws
    from grader.grading.judging.diagnosis.wiring import Switch as Switch
    from grader.grading.judging.diagnosis.wiring import conditions as conditions
    from grader.grading.judging.diagnosis.wiring import constant_value as constant_value
    from grader.grading.judging.diagnosis.wiring import given_leaf as given_leaf
    from grader.grading.judging.diagnosis.wiring import is_flag as is_flag
    from grader.grading.judging.diagnosis.wiring import is_log as is_log
    from grader.grading.judging.diagnosis.wiring import made as made
    from grader.grading.judging.diagnosis.wiring import made_for as made_for
    from grader.grading.judging.diagnosis.wiring import message_classes as message_classes
    from grader.grading.judging.diagnosis.wiring import names_in as names_in
    from grader.grading.judging.diagnosis.wiring import number_in_code as number_in_code
    from grader.grading.judging.diagnosis.wiring import pauses as pauses
    from grader.grading.judging.diagnosis.wiring import publish_calls as publish_calls
    from grader.grading.judging.diagnosis.wiring import reached as reached
    from grader.grading.judging.diagnosis.wiring import received as received
    from grader.grading.judging.diagnosis.wiring import roots as roots
    from grader.grading.judging.diagnosis.wiring import runs as runs
    from grader.grading.judging.diagnosis.wiring import switches as switches
    from grader.grading.judging.diagnosis.wiring import text_comparisons as text_comparisons
    from grader.grading.judging.diagnosis.wiring import text_in_code as text_in_code
    from grader.grading.judging.diagnosis.wiring import timer_code as timer_code
    from grader.grading.judging.diagnosis.wiring import unformatted_fields as unformatted_fields
    from grader.grading.judging.facts import LogPaceFacts as LogPaceFacts
    from grader.grading.judging.facts import WrongLogFacts as WrongLogFacts
    from grader.grading.judging.findings import FAULT_KEY as FAULT_KEY
    from grader.grading.judging.findings import fault_hint as fault_hint
    from grader.grading.judging.findings import fault_sentence as fault_sentence
    from grader.grading.judging.findings import faulted as faulted
    from grader.grading.judging.findings import first_fault as first_fault
    from grader.grading.judging.findings import only_printed as only_printed
    from grader.grading.judging.findings import waiting_for as waiting_for
    from grader.grading.judging.logs.matching import chance as chance
    from grader.grading.judging.logs.outputs import number_told as number_told
    from grader.grading.judging.logs.outputs import shape_of as shape_of
    from grader.grading.judging.logs.outputs import written as written
    from grader.grading.judging.source import Function as Function
    from grader.grading.judging.source import Source as Source
    from grader.grading.judging.source import argument as argument
    from grader.grading.judging.source import chain as chain
    from grader.grading.judging.source import first_line as first_line
    from grader.grading.judging.source import last_name as last_name
    from grader.grading.judging.source import literal_text as literal_text
    from grader.grading.judging.source import parameters as parameters
    from grader.grading.judging.source import subtree as subtree
    from grader.grading.judging.texts import Printed as Printed
    from grader.grading.judging.texts import clean as clean
    from grader.grading.judging.texts import printed_numbers as printed_numbers
    from grader.grading.judging.texts import readings as readings
    from grader.grading.judging.texts import segments as segments
    from grader.grading.judging.texts import template_of as template_of
    from grader.grading.judging.values import EXACT as EXACT
    from grader.grading.judging.values import JITTER_NS as JITTER_NS
    from grader.grading.judging.values import Held as Held
    from grader.grading.judging.values import heard_from_ns as heard_from_ns
    from grader.grading.judging.values import held as held
    from grader.grading.judging.values import per_trace as per_trace
    from grader.grading.judging.values import student_endpoints as student_endpoints
    from grader.grading.model.wording import in_unit as in_unit
    from grader.grading.model.wording import moment as moment
    from grader.grading.model.wording import number as number
    from grader.grading.model.wording import numbers as numbers
    from grader.grading.model.wording import quote as quote
    from grader.grading.model.wording import span as span
    from grader.runtime.model.quantities import NS_PER_MS as NS_PER_MS
    from grader.runtime.model.quantities import counted as counted
    from grader.runtime.model.trace import unmet_policy as unmet_policy

#: The names by topic and by the module that they are in.
CONTENTS: dict[str, dict[str, str]] = {
    "Source code": {
        "grader.grading.judging.source": (
            "Source Function first_line last_name chain argument parameters literal_text subtree"
        ),
        "grader.grading.judging.diagnosis.wiring": (
            "constant_value given_leaf made made_for roots reached runs names_in is_log publish_calls conditions "
            "is_flag timer_code received message_classes number_in_code text_in_code Switch switches text_comparisons "
            "pauses unformatted_fields"
        ),
        "grader.grading.judging.diagnosis.values": "draws",
    },
    "Rules": {
        "grader.grading.judging.diagnosis.rules": "silent_topic log_call Maker",
        "grader.grading.judging.facts": "WrongLogFacts LogPaceFacts",
    },
    "Findings": {
        "grader.grading.judging.findings": (
            "only_printed waiting_for faulted first_fault fault_sentence fault_hint FAULT_KEY"
        ),
        "grader.grading.judging.checks.services": "too_few_responses",
    },
    "Recordings": {
        "grader.runtime.model.trace": "unmet_policy",
        "grader.grading.judging.values": "Held held student_endpoints heard_from_ns per_trace EXACT JITTER_NS",
    },
    "What programs write": {
        "grader.grading.judging.logs.outputs": "written shape_of number_told",
        "grader.grading.judging.texts": "Printed printed_numbers clean readings segments template_of",
        "grader.grading.judging.logs.matching": "chance",
    },
    "Text": {
        "grader.runtime.model.quantities": "NS_PER_MS counted",
        "grader.grading.model.wording": "moment span number numbers quote in_unit",
    },
    "Charts": {
        "grader.grading.judging.charts": "series time_chart gaps_panel compared_panels drawn_case Lanes",
    },
}
_HOMES = homes(CONTENTS)

__all__ = [*_HOMES]  # noqa: PLE0604  the table is the list


def __getattr__(name: str) -> Any:
    """Import a name when it is first looked up."""
    return look_up(globals(), _HOMES, name)


def __dir__() -> list[str]:
    """List the names."""
    return sorted(__all__)
