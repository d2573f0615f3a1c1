"""Makes simulations: the built-in ones and those in an author's file, each guarded against errors and endless work."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable, Mapping
from dataclasses import is_dataclass
from types import FrameType
from typing import Any, TypeVar, get_args, get_type_hints

from grader.runtime.model.author_files import AuthorMistake, error_words, line_of, run_author_file
from grader.runtime.model.errors import HarnessError
from grader.runtime.model.worlds import WallMap
from grader.runtime.simulation.mapped import RobotInMap
from grader.runtime.simulation.participant import Simulation
from grader.runtime.simulation.robots import DifferentialDrive, Turtle

Result = TypeVar("Result")

#: The simulations that a rubric may use without a file, by name.
SIMULATIONS: Mapping[str, type[Simulation]] = {
    "differential_drive": DifferentialDrive,
    "robot_in_map": RobotInMap,
    "turtle": Turtle,
}
#: Name of the table in an author's file.
TABLE = "SIMULATIONS"
#: Processor time that one call of a simulation may take, in seconds.
CALL_S = 5.0


class SimulationError(HarnessError):
    """A simulation in a rubric's file fails; the rubric's author has to fix it."""

    def __init__(self, mistake: AuthorMistake) -> None:
        super().__init__(str(mistake))
        self.mistake = mistake


class _Endless(BaseException):
    """A call took too long; no simulation catches this by accident."""


def classes(path: str, content: bytes) -> Any:
    """Return the table of simulations in an author's file, None without one; raises what the file raises."""
    return vars(run_author_file("_own_simulations", path, content)).get(TABLE)


def made_simulation(
    name: str, path: str, content: bytes, parameters: Mapping[str, Any], maps: Mapping[str, WallMap] | None = None
) -> Simulation:
    """Return a simulation.

    Args:
        name: Its name in a rubric.
        path: The author's file with its class; empty for a built-in one.
        content: The text of that file.
        parameters: Values of its parameters.
        maps: The maps that it may use, by name.

    Raises:
        HarnessError: The file or the class raises an error.
    """

    def make() -> Simulation:
        kind: type[Simulation] = (classes(path, content) if path else SIMULATIONS)[name]
        has_parts = any(isinstance(value, (list, tuple)) for value in parameters.values())
        hints = get_type_hints(kind) if has_parts else {}
        made = kind(**{key: _as_parameter(value, hints.get(key)) for key, value in parameters.items()})
        made.maps = dict(maps or {})
        return made

    return guarded(name, path, make)


def guarded(name: str, path: str, work: Callable[[], Result], begins: int = 1, most_s: float = CALL_S) -> Result:
    """Call a simulation, and return what it returns.

    Args:
        name: Its name in a rubric.
        path: The author's file, empty for a built-in simulation.
        work: The call.
        begins: The line to name if an error arises outside of the file, because a method returns something wrong.
        most_s: Processor time that the call may take, in seconds.

    Raises:
        SimulationError: It is in an author's file, and raises an error or takes too long.
        HarnessError: The same of a built-in one.
    """

    def stop(number: int, frame: FrameType | None) -> None:
        del number, frame
        raise _Endless(f"the call took more than {most_s:g} s of processor time")

    timed = threading.current_thread() is threading.main_thread()
    before = signal.signal(signal.SIGVTALRM, stop) if timed else None
    try:
        if timed:
            signal.setitimer(signal.ITIMER_VIRTUAL, most_s)
        return work()
    except (Exception, SystemExit, _Endless) as error:  # whatever the author's file raises, the author has to fix
        kind = "" if isinstance(error, _Endless) else f"{type(error).__name__}: "
        text = f"the simulation `{name}` failed: {kind}{error_words(error)[:200]}"
        if not path:
            raise HarnessError(text) from error
        raise SimulationError(AuthorMistake(path, line_of(error, path, begins), text)) from error
    finally:
        if timed:
            signal.setitimer(signal.ITIMER_VIRTUAL, 0)
            signal.signal(signal.SIGVTALRM, before)


def begin_of(simulation: Simulation, method: str, path: str) -> int:
    """Return the line of an author's file in which a method of a simulation begins; 0 if it begins elsewhere."""
    code = getattr(getattr(type(simulation), method, None), "__code__", None)
    return code.co_firstlineno if code is not None and code.co_filename == path else 0


def _as_parameter(value: Any, hint: Any) -> Any:
    """Return the value of a parameter from what a plan holds: lists become tuples, mappings the parts of a tuple."""
    if isinstance(value, Mapping) and is_dataclass(hint):
        hints = get_type_hints(hint)
        return hint(**{key: _as_parameter(inner, hints.get(key)) for key, inner in value.items()})  # type: ignore[operator]
    if isinstance(value, (list, tuple)):
        kinds = get_args(hint)
        return tuple(_as_parameter(inner, kinds[0] if kinds else None) for inner in value)
    return value
