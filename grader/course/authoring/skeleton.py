"""Skeletons of rubrics: the draft, and its text with comments for the author."""

from __future__ import annotations

import json
import math
import re
import textwrap
from collections.abc import Iterator, Mapping, Sequence

from grader.grading.rubrics.schema import FILE
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.wording import listed


@dataclass(frozen=True, slots=True)
class DraftQuantity:
    """Text that is written unquoted, such as a number with its unit."""

    text: str


def in_seconds(duration_s: float) -> DraftQuantity:
    """Return a duration as rubrics write it."""
    return DraftQuantity(f"{duration_s:g} s")


@dataclass(frozen=True, slots=True)
class DraftStimulus:
    """A stimulus of the draft, with a comment on what is left for the author to decide."""

    kind: str
    parameters: Mapping[str, object]
    comment: str = ""


@dataclass(frozen=True, slots=True)
class DraftCriterion:
    """A proposed criterion, with a comment on what is left for the author to decide."""

    id: str
    title: str
    check: str
    parameters: Mapping[str, object]
    hint: str
    needs: str = ""
    comment: str = ""


@dataclass(frozen=True, slots=True)
class Draft:
    """The contents of a skeleton."""

    id: str
    files: tuple[str, ...]  # files of the reference; each runs in its own process
    duration_s: float
    after: str = ""  # topic whose first message starts the observation; empty for the start of the nodes
    may_exit: tuple[str, ...] = ()  # files that end by themselves
    stimuli: tuple[DraftStimulus, ...] = ()
    criteria: tuple[DraftCriterion, ...] = ()
    remarks: tuple[str, ...] = ()
    simulations: tuple[str, ...] = ()  # files of simulations, relative to the rubric


def as_id(text: str) -> str:
    """Make an id from any text: lower-case letters, digits and `_`, starting with a letter."""
    words = re.sub(r"[^a-z0-9]+", "_", re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", text).lower()).strip("_")
    return words if words[:1].isalpha() else f"x_{words}".rstrip("_")


#: Points of every criterion, until the author changes them.
POINTS = 5
_WIDTH = 100
#: Longest line for parameters in flow style.
_LONGEST = 120
# Text that needs no quotes inside `{...}`, and that YAML does not read as a number or a keyword.
_PLAIN = re.compile(r"[A-Za-z_/][A-Za-z0-9_./]*")
_WORDS = ("true", "false", "null", "yes", "no", "on", "off")


def rubric_text(draft: Draft, left_out: Sequence[tuple[DraftCriterion, str]] = ()) -> str:
    """Render a draft as the text of a rubric; the criteria left out become comments, each with its reason."""
    return "\n".join(_lines(draft, left_out)) + "\n"


def _lines(draft: Draft, left_out: Sequence[tuple[DraftCriterion, str]]) -> Iterator[str]:
    yield f"# yaml-language-server: $schema={FILE}"
    files = listed(draft.files, "and")
    yield from _comment(f"A skeleton, made of what {files} did. What is marked `decide:` only you can know.")
    yield from _comment("`grade rubric check` says whether it can be used, `grade rubric explain` what it asks.")
    for remark in draft.remarks:
        yield from _comment(f"{remark[:1].upper()}{remark[1:]}.")
    yield from ("schema: grader/rubric/v1", "", "exercise:", f"  id: {draft.id}")
    title = draft.id.replace("_", " ").capitalize()
    yield from ('  number: "1"  # decide: what is its number in the course?', f"  title: {_scalar(title)}")
    yield from ("  required: true", "", f"files: {_value(list(draft.files))}")
    if draft.simulations:
        yield f"simulations: {_value(list(draft.simulations))}"
    yield ""
    yield from _scenario(draft)
    yield from ("", "criteria:")
    yield from _comment(f"decide: what is each of these worth? All have {POINTS} points so far.", "  ")
    for criterion in draft.criteria:
        yield from _criterion(criterion, scenario_id(draft))
        yield ""
    if left_out:
        asked = "decide: does the task ask for any of these? The reference does not meet them as they stand here."
        yield from _comment(asked, "  ")
    for criterion, reason in left_out:
        yield from _comment(reason, "  ")
        yield from (f"  # {line}" for line in _criterion(criterion, scenario_id(draft)))


def scenario_id(draft: Draft) -> str:
    """Return the id of the draft's only scenario."""
    return "alone" if len(draft.files) == 1 else "together"


def _scenario(draft: Draft) -> Iterator[str]:
    observe: dict[str, object] = {"duration": in_seconds(draft.duration_s)}
    if draft.after:
        observe |= {"after_first_message_on": draft.after, "wait_at_most": in_seconds(60)}
    yield from ("scenarios:", f"  - id: {scenario_id(draft)}", f"    processes: {_value(list(draft.files))}")
    if draft.may_exit:
        yield f"    may_exit: {_value(list(draft.may_exit))}"
    yield f"    observe: {_value(observe)}"
    if draft.stimuli:
        yield "    stimuli:"
    for stimulus in draft.stimuli:
        yield from _comment(stimulus.comment, "      ")
        yield from _mapping(f"      - {stimulus.kind}:", stimulus.parameters, " " * 10)


def _criterion(criterion: DraftCriterion, scenario: str) -> Iterator[str]:
    yield f"  - id: {criterion.id}"
    yield f"    title: {_scalar(criterion.title)}"
    yield f"    points: {POINTS}"
    yield f"    scenario: {scenario}"
    yield "    check:"
    yield from _comment(criterion.comment, "      ")
    yield from _mapping(f"      {criterion.check}:", criterion.parameters, " " * 8)
    if criterion.needs:
        yield f"    needs: [{criterion.needs}]"
    yield f"    hint: {_scalar(criterion.hint)}"


def _comment(text: str, indent: str = "") -> Iterator[str]:
    line = " ".join("".join(c if c.isprintable() else " " for c in text).split())
    start = f"{indent}# "
    yield from textwrap.wrap(line, _WIDTH, initial_indent=start, subsequent_indent=start, break_on_hyphens=False)


def _mapping(start: str, parameters: Mapping[str, object], indent: str) -> Iterator[str]:
    """Yield parameters on the line of their key, or below it if the line would be too long."""
    line = f"{start} {_value(parameters)}"
    if len(line) <= _LONGEST:
        yield line
        return
    yield start
    for key, value in parameters.items():
        if isinstance(value, (list, tuple)) and any(isinstance(inner, Mapping) for inner in value):
            yield f"{indent}{_plain(str(key))}:"
            yield from (f"{indent}  - {_value(inner)}" for inner in value)
        else:
            yield f"{indent}{_plain(str(key))}: {_value(value)}"


def _value(value: object) -> str:
    """Format a value as YAML on one line."""
    if isinstance(value, DraftQuantity):
        return value.text
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{_plain(str(key))}: {_value(inner)}" for key, inner in value.items()) + "}"
    if isinstance(value, (list, tuple)):
        return f"[{', '.join(map(_value, value))}]"
    if isinstance(value, bool):
        return "true" if value else "false"
    return _number(value) if isinstance(value, (int, float)) else _plain(str(value))


def _number(value: float) -> str:
    if not math.isfinite(value):
        return ".nan" if math.isnan(value) else ".inf" if value > 0 else "-.inf"
    if float(value).is_integer() and abs(value) < 1e15:
        return str(int(value))
    short = f"{value:.6g}"
    # a 32-bit float has a long tail of digits that nobody wrote
    return short if abs(float(short) - value) <= 1e-7 * max(1.0, abs(value)) else repr(float(value))


def _plain(text: str) -> str:
    fits = _PLAIN.fullmatch(text) is not None and text.lower() not in _WORDS
    return text if fits else json.dumps(text, ensure_ascii=False)


def _scalar(text: str) -> str:
    """Format a sentence as a YAML value on one line."""
    risky = re.search(r"[\"'#:{}\[\]&*!|>%@`\\]|^[-?\s]", text) is not None or not text.isprintable()
    return json.dumps(text, ensure_ascii=False) if risky else text
