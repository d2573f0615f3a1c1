"""What programs are given when they run without a rubric: messages and simulations that the command line names."""

from __future__ import annotations

import math
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import field
from pathlib import Path
from types import MappingProxyType
from typing import Any

from ruamel.yaml import YAML

from grader.grading.app.interfaces import known_interfaces
from grader.grading.rubrics.loader import RubricMistakes, read_rubric
from grader.grading.rubrics.yaml_tree import YamlSyntaxError, read_yaml
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.errors import GraderError, RubricError
from grader.runtime.model.scenario import Stimulus, is_launch_file
from grader.runtime.model.wording import listed, printable
from grader.runtime.simulation import SIMULATIONS

#: Time before the first message, in seconds, to observe how the nodes wait.
FIRST_S = 1.0
#: Topic -> fields of the messages to send.
SentMessages = Mapping[str, Sequence[Mapping[str, object]]]
#: No message was named.
NOTHING: SentMessages = MappingProxyType({})


@dataclass(frozen=True, slots=True)
class NamedSimulation:
    """A simulation that takes part, with values for its parameters."""

    name: str  # in the table of its file, or that of a built-in one
    file: Path | None = None  # the file with its class; None for a built-in one
    parameters: Mapping[str, object] = field(default_factory=dict)  # as in a rubric

    @property
    def option(self) -> str:
        """The option that names it, for messages."""
        return f"--simulation {printable(self.name if self.file is None else f'{self.file}:{self.name}')}"


def read_sent(sent: Sequence[str]) -> SentMessages:
    """Parse messages to send, `TOPIC={field: value}`, by topic; raises GraderError for invalid ones."""
    given: dict[str, list[Mapping[str, object]]] = {}
    for text in sent:
        topic, _, fields = text.partition("=")
        data = _mapping(fields)
        if not topic.startswith("/") or data is None:
            raise GraderError(f"--send {printable(text)}: expected TOPIC={{field: value}}, found something else")
        given.setdefault(topic, []).append(data)
    return given


def read_launch_arguments(texts: Sequence[str], programs: Sequence[Path]) -> tuple[tuple[str, str], ...]:
    """Parse launch arguments, `NAME:=VALUE`.

    Raises:
        GraderError: One is written in another way or given twice, or no program is a launch file.
    """
    given: dict[str, str] = {}
    for text in texts:
        name, written, value = text.partition(":=")
        if not (name and written):
            raise GraderError(f"--launch-argument {printable(text)}: expected NAME:=VALUE, found something else")
        if name in given:
            raise GraderError(
                f"--launch-argument {printable(text)}: expected each argument once, found {printable(name)} again"
            )
        given[name] = value
    if given and not any(is_launch_file(program.name) for program in programs):
        raise GraderError("--launch-argument: expected a launch file among the programs, found none")
    return tuple(given.items())


def read_simulations(texts: Sequence[str]) -> tuple[NamedSimulation, ...]:
    """Parse simulations, `FILE.py:NAME` or the name of a built-in one, each perhaps with `={parameter: value}`.

    Raises:
        GraderError: One is written in another way, or there is no such file.
    """
    return tuple(map(_read_simulation, texts))


def _read_simulation(text: str) -> NamedSimulation:
    which, equals, given = text.partition("=")
    file, colon, name = which.rpartition(":")
    parameters = _mapping(given) if equals else {}
    if parameters is None or (not colon and name not in SIMULATIONS):
        known = listed(list(SIMULATIONS))
        expected = f"expected FILE.py:NAME or a built-in one ({known}), perhaps with ={{parameter: value}}"
        raise GraderError(f"--simulation {printable(text)}: {expected}, found something else")
    if colon and not Path(file).is_file():
        raise GraderError(
            f"--simulation {printable(text)}: expected a file with simulations, found no {printable(file)}"
        )
    if not colon and parameters.get("map"):
        raise GraderError(
            f"--simulation {printable(name)}: expected no `map`, because only a rubric brings maps",
            "write walls as `boxes`, or grade with a rubric that lists the map under `maps`",
        )
    return NamedSimulation(name, Path(file) if colon else None, parameters)


def _mapping(text: str) -> dict[str, Any] | None:
    try:
        data = read_yaml(text).data
    except YamlSyntaxError:
        return None
    return data if isinstance(data, dict) else None


def period_s(duration_s: float, count: int) -> float:
    """Return the time between messages that spreads them over the time that is left, in seconds, at most 2."""
    return min(2.0, max(0.1, math.floor(10 * (duration_s - FIRST_S) / (count + 1)) / 10))


def simulated(simulations: Sequence[NamedSimulation], course: tuple[Path, ...] = ()) -> tuple[Stimulus, ...]:
    """Return simulations as stimuli, read as strictly as in a rubric; raises GraderError for a mistake."""
    return tuple(stimulus for one in simulations for stimulus in _read([one], [], 10.0, course, one.option))


def messages(
    sent: SentMessages, types: Mapping[str, str], duration_s: float, course: tuple[Path, ...] = ()
) -> tuple[Stimulus, ...]:
    """Return messages as stimuli, read as strictly as in a rubric.

    Args:
        sent: The messages by topic.
        types: Type of each topic that the programs subscribe to.
        duration_s: How long they are observed, in seconds.
        course: Folders with interface packages.

    Raises:
        GraderError: Nobody subscribes to a topic, or a message does not fit its type.
    """
    stimuli: list[Mapping[str, Any]] = []
    for topic, values in sent.items():
        if topic not in types:
            known = listed([printable(one) for one in types]) if types else "they subscribe to none"
            expected = f"expected a topic that the programs subscribe to ({known}), found another"
            raise GraderError(f"--send {printable(topic)}: {expected}")
        times = {"period": f"{period_s(duration_s, len(values)):g} s", "start": f"{min(FIRST_S, duration_s / 2):g} s"}
        stimuli.append({"messages": {"topic": topic, "type": types[topic], "values": list(values), **times}})
    return _read([], stimuli, duration_s, course, "--send")


#: A rubric needs a criterion.
_ANY = {"id": "runs", "title": "Runs", "points": 1, "scenario": "observed", "check": {"no_fault": {}}}


def _read(
    simulations: Sequence[NamedSimulation],
    stimuli: Sequence[Mapping[str, Any]],
    duration_s: float,
    course: tuple[Path, ...],
    option: str,
) -> tuple[Stimulus, ...]:
    """Return the stimuli of a rubric that has nothing else."""
    with tempfile.TemporaryDirectory(prefix="grade-inputs-") as folder:
        files = {one.file.name: one.file for one in simulations if one.file is not None}
        for name, file in files.items():
            copied_simulation(file, Path(folder) / name)
        named = [{"simulation": {one.name: dict(one.parameters)}} for one in simulations]
        about = {"id": "observed", "processes": ["node.py"], "observe": {"duration": f"{duration_s:g} s"}}
        rubric = {
            "schema": "grader/rubric/v1",
            "exercise": {"id": "observed", "number": "1", "title": "Observed"},
            "files": ["node.py"],
            "simulations": list(files),
            "scenarios": [{**about, "stimuli": [*named, *stimuli]}],
            "criteria": [
                {"id": "runs", "title": "Runs", "points": 1, "scenario": "observed", "check": {"no_fault": {}}}
            ],
        }
        path = Path(folder) / "rubric.yaml"
        with path.open("w", encoding="utf-8") as out:
            YAML(typ="safe").dump(rubric, out)
        try:
            return read_rubric(path, interfaces=known_interfaces(course)).scenarios[0].stimuli
        except RubricMistakes as error:
            raise GraderError(f"{option}: {error.mistakes[0].text}", error.mistakes[0].hint) from None
        except RubricError as error:
            first = error.message.splitlines()[0]
            for name, file in files.items():
                first = first.replace(str(Path(folder) / name), printable(str(file)))
            raise GraderError(first, error.hint) from None


def copied_simulation(file: Path, copy: Path) -> None:
    """Copy the file of a simulation, and make the folder for it; raises GraderError if it cannot be read."""
    copy.parent.mkdir(parents=True, exist_ok=True)
    try:
        copy.write_bytes(file.read_bytes())
    except OSError as error:
        raise GraderError(f"--simulation {printable(str(file))}: cannot be read: {error.strerror or error}") from None
