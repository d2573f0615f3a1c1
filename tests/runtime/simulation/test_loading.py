"""Loading simulations: an author's errors are told with file and line, and endless work is ended."""

from __future__ import annotations

from pathlib import Path

import pytest

from grader.runtime.model.errors import HarnessError
from grader.runtime.simulation import DifferentialDrive, loading
from grader.runtime.simulation.loading import guarded, made_simulation

FILE = b"""\
from dataclasses import dataclass
from grader.runtime.simulation import Simulation

@dataclass
class Slow(Simulation):
    seen: tuple[int, ...] = ()

    def step(self, now):
        while True:
            pass

SIMULATIONS = {"slow": Slow}
"""


def test_a_built_in_simulation_is_made_with_its_parameters() -> None:
    """As JSON brings them to the worker."""
    robot = made_simulation("differential_drive", "", b"", {"x": 2.5, "frame": "map"})
    assert isinstance(robot, DifferentialDrive)
    assert (robot.x, robot.frame) == (2.5, "map")


def test_an_authors_simulation_is_made_from_the_text_of_its_file() -> None:
    """Lists become tuples again."""
    assert made_simulation("slow", "slow.py", FILE, {"seen": [1, 2]}).seen == (1, 2)  # type: ignore[attr-defined]


@pytest.mark.parametrize(
    ("content", "told"),
    [
        (b"import no_such_module\n", "world.py:1: the simulation `slow` failed: ModuleNotFoundError"),
        (b"x = 1\n\nraise SystemExit(3)\n", "world.py:3: the simulation `slow` failed: SystemExit: 3"),
        (b"SIMULATIONS = {\n", "world.py:1: the simulation `slow` failed: SyntaxError"),
        (FILE.replace(b"Slow(Simulation)", b"Slow(NoSuchName)"), "world.py:5: the simulation `slow` failed: NameError"),
    ],
)
def test_an_error_in_the_file_is_told_with_its_line(content: bytes, told: str) -> None:
    """Every time that it is loaded: a failed file is not kept."""
    for _ in range(2):
        with pytest.raises(HarnessError) as error:
            made_simulation("slow", "world.py", content, {})
        assert error.value.message.startswith(told)


def test_a_call_without_end_is_ended() -> None:
    """It would take the worker to its limit of processor time, which counts as a fault of the student's nodes."""
    slow = made_simulation("slow", "slow.py", FILE, {})
    with pytest.raises(
        HarnessError, match=r"slow.py:\d+: the simulation `slow` failed: the call took more than 0.05 s"
    ):
        guarded("slow", "slow.py", lambda: slow.step(None), most_s=0.05)  # type: ignore[arg-type]
    assert guarded("slow", "slow.py", lambda: 1) == 1


def test_the_worker_needs_nothing_but_the_standard_library_for_it() -> None:
    """It sees no other part of the grader than the runtime."""
    folder = Path(loading.__file__).parent
    lines = [line for file in folder.glob("*.py") for line in file.read_text(encoding="utf-8").splitlines()]
    modules = [line.split()[1].split(".") for line in lines if line.startswith(("from ", "import "))]
    imported = {".".join(parts[: 3 if parts[0] == "grader" else 1]) for parts in modules}
    standard = {"__future__", "collections", "dataclasses", "functools", "math", "random", "signal", "threading"}
    standard |= {"types", "typing"}
    assert imported <= standard | {"grader.runtime.model", "grader.runtime.simulation"}
