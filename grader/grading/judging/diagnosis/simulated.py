"""The hint rule for what a simulation does not hear: it is asked before all others, because they take it as heard."""

from __future__ import annotations

from grader.grading.judging.diagnosis.rules import Case, Clue, file_for, hint_rule
from grader.grading.judging.diagnosis.wiring import made_for
from grader.grading.judging.simulations import NotHeard, not_heard
from grader.grading.judging.values import student_endpoints
from grader.grading.model.exercise import roles_of, texts_under


@hint_rule(priority=10)
def _unheard_by_simulation(case: Case) -> Clue | None:
    """A publisher has another type or topic than the simulation hears."""
    found = next((one for one in not_heard(case.trace) if _may_explain(one, case)), None)
    if found is None:
        return None
    end = found.end
    source = file_for(case, "publisher", end.topic)
    made = made_for(source, "publisher", end.topic, end.type)
    place = source.place(made.call) if made is not None else None
    wanted = f"publish {' or '.join(found.types)}" if end.topic == found.topic else f"publish on {found.topic}"
    return Clue(f"{found.sentence}: {wanted}", place, key=f"unheard:{found.topic}")


def _may_explain(found: NotHeard, case: Case) -> bool:
    """Return whether a criterion is about the commands, or about what the simulation makes of them."""
    if case.logs:
        return False
    topics = {*case.topics, *texts_under(case.check, *roles_of(type(case.check)).topics)}
    if topics & {found.topic, found.end.topic}:
        return True
    heard = {end.topic for end in student_endpoints(case.trace, "subscription")}
    return any(case.trace.deliveries(topic) and topic in heard for topic in topics)
