"""Opens worlds: what all of them run in is started once, and each has a network domain of its own in it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.errors import EnvironmentFault
from grader.runtime.model.limits import Limits
from grader.runtime.model.quantities import GIB, MIB, NS_PER_S
from grader.runtime.model.trace import ClockKind
from grader.runtime.plan import Plan, derive
from grader.runtime.session import OWN_PROGRAMS, RecordingSession, open_session, runs_a_test
from grader.world.faults import ALL, RunDraws, faults_of_run
from grader.world.measuring import measured_lines
from grader.world.own_programs import OwnPrograms, modules_near
from grader.world.world import World, WorldSetting

#: How much the programs of a test may use, and how much of it is kept: they are trusted, so these are only to end what
#: runs away. Images of some megabytes have to fit.
OWN_LIMITS = Limits(
    memory_bytes=16 * GIB,
    processor_ns=3600 * NS_PER_S,
    processes=4096,
    output_bytes=64 * MIB,
    lines=1_000_000,
    open_files=4096,
    file_bytes=64 * GIB,
    scratch_bytes=64 * GIB,
    wall_ns=24 * 3600 * NS_PER_S,
    messages=1_000_000,
    message_bytes=64 * MIB,
    traffic_bytes=1 * GIB,
    participants=200,
)


@dataclass(frozen=True, slots=True)
class Worlds:
    """What worlds run in, in turn or at the same time.

    Attributes:
        session: The workers.
        folder: Where programs are looked for last.
        measured: How the lines of programs are measured; see `measured_lines`.
        debugger: Where a debugger of programs is; see `debugger_at`.
        updates_recordings: Whether tests write the recordings that they would compare with.
    """

    session: RecordingSession
    folder: Path
    measured: str = ""
    debugger: str = ""
    updates_recordings: bool = False

    @property
    def shared(self) -> str:
        """Why the nodes use the network of this machine, in words; empty if they have a network of their own."""
        return self.session.shared

    @contextmanager
    def open(  # noqa: PLR0913 - the options of the marker
        self,
        near: Path | None = None,
        *,
        clock: str = "virtual",
        seed: int | None = None,
        name: str = "test",
        delay: Mapping[str, tuple[float, float]] | None = None,
        lose: Mapping[str, float] | None = None,
        between: Mapping[str, Mapping[str, Any]] | None = None,
        swarm: bool = False,
        only: RunDraws = ALL,
    ) -> Iterator[World]:
        """Open a world, and end all of its programs at the end of the block.

        Args:
            near: Where programs are looked for first; then in the folder of these worlds, and in the working directory.
            clock: `virtual`, or `wall` for real time, in which no order is drawn.
            seed: What delays, losses, and the order of programs and callbacks that are ready at one instant are drawn
                from; None for the order in which programs were started, and that of rclpy.
            name: Name of its recording.
            delay: For topics that are published on from outside, the least and the most seconds that a message is on
                its way.
            lose: For such topics, the share of messages that are lost, from 0 to 1.
            between: For topics and programs, what is done to them; as for the marker `ros` of pytest.
            swarm: Whether the seed also draws which of these faults are on.
            only: What is drawn at all, of all that the seed draws.
        """
        time, drawn = clock_named(clock), seed or 0
        folders = tuple(dict.fromkeys(path.resolve() for path in (near, self.folder, Path()) if path is not None))
        faults = faults_of_run(drawn, delay=delay, lose=lose, between=between, swarm=swarm, only=only)
        plan = Plan(
            scenario=name,
            processes=(),
            root="/",
            host_seed=derive(drawn, "world"),
            duration_ns=0,
            first_message_on="",
            wait_at_most_ns=0,
            clock=time.value,
            limits=OWN_LIMITS,
            drawn_order=seed is not None and time is not ClockKind.WALL,
            working=str(Path.cwd()),
            interfaces=modules_near(folders[:1]),
            measured=self.measured,
            debugger=self.debugger,
            connections=faults.connections,
            faults=faults.injected,
            drawn_steps=only.steps,
        )
        setting = WorldSetting(self.session, OwnPrograms(self.session, folders, drawn), folders)
        world = World(setting, plan, drawn, faults.names)
        world.updates_recordings = self.updates_recordings
        try:
            yield world
            world.finish()
        finally:
            world.close()


def clock_named(name: str) -> ClockKind:
    """Return the clock of a name; raises ValueError if there is none."""
    if name not in [kind.value for kind in ClockKind]:
        raise ValueError(f"clock: expected virtual or wall, found {name!r}")
    return ClockKind(name)


@contextmanager
def open_worlds(folder: Path, *, measured: str = "", debugger: str = "", own_network: bool = True) -> Iterator[Worlds]:
    """Start what worlds run in, and end it at the end of the block.

    Args:
        folder: Where programs are looked for last.
        measured: How the lines of programs are measured; see `measured_lines`.
        debugger: Where a debugger of programs is; see `debugger_at`.
        own_network: Whether programs get a network of their own, if possible; who is outside cannot reach them there.

    Raises:
        EnvironmentFault: This machine lacks ROS.
    """
    if runs_a_test():
        raise EnvironmentFault("a test of a rubric runs programs in no world of its own", "use the fixture `ros`")
    with open_session(OWN_PROGRAMS, workers=1, own_network=own_network) as session:
        yield Worlds(session, folder, measured, debugger)


@contextmanager
def open_world(  # noqa: PLR0913 - the options of the marker
    near: Path | str = "",
    *,
    clock: str = "virtual",
    seed: int | None = None,
    delay: Mapping[str, tuple[float, float]] | None = None,
    lose: Mapping[str, float] | None = None,
    between: Mapping[str, Mapping[str, Any]] | None = None,
) -> Iterator[World]:
    """Run programs step by step without pytest: in a script, or in the cells of a notebook.

    A notebook shows the world, as the last value of a cell, as a page that plays the run so far.

    Args:
        near: Where programs are looked for first.
        clock: `virtual`, or `wall` for real time, in which no order is drawn.
        seed: What delays, losses, and the order of programs and callbacks that are ready at one instant are drawn from;
            None for the order in which programs were started, and that of rclpy.
        delay: As for the marker `ros` of pytest.
        lose: As for the marker `ros` of pytest.
        between: As for the marker `ros` of pytest.

    Raises:
        EnvironmentFault: This machine lacks ROS.
    """
    with (
        open_worlds(Path(), measured=measured_lines(Path.cwd())) as worlds,
        worlds.open(Path(near), clock=clock, seed=seed, delay=delay, lose=lose, between=between) as world,
    ):
        yield world
