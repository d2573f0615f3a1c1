"""What each submission of a class is graded with, where a rubric differs from student to student."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from grader.app.grade import read_exercises
from grader.app.seeds import read_key
from grader.app.variants import ByKey, checked, drawn
from grader.classroom.cache_key import Conditions
from grader.classroom.intake import HandedInEntry
from grader.classroom.request import ClassRequest
from grader.classroom.roster import Person
from grader.core.errors import ClassError, VariantError
from grader.core.exercise import Exercise

_NOBODY = "whose variant it is to be graded by is not clear: nobody on the roster goes with it for sure"
_NO_ID = (
    "whose variant it is to be graded by is not clear: the roster has no number, user name or address of this person"
)


def student_of(person: Person | None) -> str:
    """Return what a person's variants are drawn for: the number, else the user name, else the address; or nothing."""
    return "" if person is None else next((text for text in (person.id, person.user, person.email) if text), "")


def with_known_students(
    entries: Sequence[HandedInEntry], people: Mapping[str, Person], exercises: Sequence[Exercise]
) -> tuple[HandedInEntry, ...]:
    """Return the submissions; where something varies, those whose student is not known cannot be graded.

    Args:
        entries: The submissions.
        people: Name of a submission -> whose it is, for those that are clear.
        exercises: What is graded.
    """
    if not vary(exercises):
        return tuple(entries)
    return tuple(entry if entry.problem else _known(entry, people.get(entry.name)) for entry in entries)


def _known(entry: HandedInEntry, person: Person | None) -> HandedInEntry:
    try:
        checked(student_of(person))
    except VariantError:
        return replace(entry, problem=_NOBODY if person is None else _NO_ID)
    return entry


def vary(exercises: Sequence[Exercise]) -> bool:
    """Return whether anything differs from student to student."""
    return any(exercise.variant is not None for exercise in exercises)


def refuse_without_key(course: ClassRequest, exercises: Sequence[Exercise]) -> None:
    """Make sure that variants can be drawn, if there are any.

    Raises:
        ClassError: There is no roster.
        VariantError: There is no course key.
    """
    if not vary(exercises):
        return
    if course.grading.variant_key is None:
        text = "--variant-key: expected the course key, because a rubric has variants, found none"
        raise VariantError(text, "name its file with --variant-key FILE")
    if course.roster is None:
        text = "--roster: expected the people of the class, because a rubric has variants, found no roster"
        raise ClassError(text, "name it with --roster CSV: it says whose variant a submission is graded by")


def own_conditions(
    course: ClassRequest,
    entries: Sequence[HandedInEntry],
    people: Mapping[str, Person],
    exercises: Sequence[Exercise],
    conditions: Conditions,
) -> dict[str, Conditions]:
    """Return name of a submission -> what it is graded with.

    Args:
        course: What was asked for.
        entries: The submissions.
        people: Name of a submission -> whose it is.
        exercises: What is graded, by nobody's variant.
        conditions: What the whole class is graded with.

    Raises:
        GraderError: The course key or a rubric cannot be used.
    """
    if not vary(exercises) or course.grading.variant_key is None:
        return {entry.name: conditions for entry in entries}
    key = read_key(course.grading.variant_key, "course key")
    found: dict[str, Conditions] = {}
    for entry in entries:
        found[entry.name] = conditions
        if not entry.problem:
            draw = ByKey(key, checked(student_of(people.get(entry.name))))
            own = read_exercises(replace(course.grading, draw=draw), course.sources)
            digests = tuple((exercise.id, exercise.digest) for exercise in own)
            found[entry.name] = replace(conditions, rubrics=digests, variants=drawn(own, draw.student))
    return found
