"""Plans: a scenario with every random value drawn, as the supervisor sends it to a worker."""

from __future__ import annotations

import hashlib
import json
import posixpath
import random
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import field
from shlex import quote
from typing import TypeVar

from grader.runtime.host.clock import EPOCH_NS, EPOCH_SPAN_S, UPTIME_NS, UPTIME_SPAN_S
from grader.runtime.host.packages import layout_of
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.limits import MAX_NAME_BYTES, Limits
from grader.runtime.model.projects import Project
from grader.runtime.model.quantities import NS_PER_S
from grader.runtime.model.scenario import Event, Planned, RunOptions, Scenario, is_launch_file, longest, shortest
from grader.runtime.model.submission import Beginning, Submission
from grader.runtime.model.trace import Endpoint
from grader.runtime.stimuli import KINDS
from grader.runtime.stimuli.drawing import Draws, drawn_time
from grader.runtime.stimuli.events import events_in_order
from grader.runtime.stimuli.recorded import RecordedStream, Recording

#: The most characters of what a process is started with, as JSON. It is handed over as one argument of a program, for
#: which Linux allows 128 KiB (MAX_ARG_STRLEN, execve(2)); a large parameter file of a course has 10.
MOST_START_CHARACTERS = 64 << 10
Kind = TypeVar("Kind", bound=Planned)


@dataclass(frozen=True, slots=True)
class InjectedFault:
    """What is done to the programs of a stepped run, or to what they send each other.

    Attributes:
        kind: `delay` or `lose`, of what programs publish on a topic and another one receives; `pause` or `kill`, of a
            program.
        on: The topic, or the name of the program.
        least_ns: The least time: on the way, of the pause, or from the start of the run until the program is killed.
        most_ns: The most.
        share: The share of messages that are lost.
        seed: Hex; what is drawn in the run follows from it.
    """

    kind: str
    on: str
    least_ns: int
    most_ns: int
    share: float
    seed: str

    @property
    def name(self) -> str:
        """What tells it from the other faults of a run."""
        return f"{self.kind} {self.on}"


@dataclass(frozen=True, slots=True)
class PlannedConnection:
    """What happens to the messages of stimuli on a topic, on their way to the processes.

    Attributes:
        topic: Its absolute name.
        delay_ns: Least and most time on the way; each message draws its own.
        lose: The share of messages that are lost.
        seed: Hex; what is drawn in the run follows from it.
    """

    topic: str
    delay_ns: tuple[int, int]
    lose: float
    seed: str


def _is_plain(name: str) -> bool:
    """Whether a name has ASCII letters, digits, hyphens, underscores and dots only, and an ending."""
    stem, _, ending = name.rpartition(".")
    known = f"_{stem}".replace("-", "_").replace(".", "_").isidentifier()
    return known and ending.isalnum() and name.isascii() and len(name) <= MAX_NAME_BYTES


@dataclass(frozen=True, slots=True)
class PlannedStart:
    """What one process is started with.

    Attributes:
        process: Name of the process.
        executable: Name of the entry point to run; empty for the one that suits the file.
        arguments: Arguments of the program, before the ROS arguments.
        ros_arguments: What follows `--ros-args`, without parameter files.
        parameter_files: Name and text of parameter files.
        launch_arguments: Name and value of each argument, for a launch file.
        provided: Name and text of files that the launch file may need.
        known: Name of each handed-in file by its path in the submission, and by its path and executable.
        launched_by: The launch file that the process comes from, with its line.
        given_parameters: The names of parameters that the launch file gives the node by name.
        given_remappings: Old and new names that it gives the node.
    """

    process: str
    executable: str = ""
    arguments: tuple[str, ...] = ()
    ros_arguments: tuple[str, ...] = ()
    parameter_files: tuple[tuple[str, str], ...] = ()
    launch_arguments: tuple[tuple[str, str], ...] = ()
    provided: tuple[tuple[str, str], ...] = ()
    known: tuple[tuple[str, str], ...] = ()
    launched_by: str = ""
    given_parameters: tuple[str, ...] = ()
    given_remappings: tuple[tuple[str, str], ...] = ()

    @property
    def words(self) -> str:
        """The arguments as they are typed; empty if there are none."""
        files = [f"--params-file {quote(name)}" for name, _ in self.parameter_files]
        ros = [*map(quote, self.ros_arguments), *files]
        return " ".join([*map(quote, self.arguments), *(["--ros-args", *ros] if ros else [])])

    @property
    def copied_files(self) -> tuple[tuple[str, str], ...]:
        """Name and text of the copies of parameter files that the process reads; rcl names a copy that it cannot read.

        A copy has the name of its file, unless that is not plain: a launch file gives single values as well.
        """
        return tuple((name if _is_plain(name) else "parameters.yaml", text) for name, text in self.parameter_files)

    @property
    def problem(self) -> str:
        """Why no process can be started with this, as a phrase; empty if one can."""
        given = (self.arguments, self.ros_arguments, self.parameter_files)
        most = f"{MOST_START_CHARACTERS >> 10} KiB"
        long = len(json.dumps(given)) > MOST_START_CHARACTERS
        return f"stopped: its arguments and parameter files have more than {most}" if long else ""


@dataclass(frozen=True, slots=True)
class Plan:
    """Everything that a worker needs to run one scenario.

    Attributes:
        scenario: Scenario id.
        processes: Name (the wanted file) and found file of each student process, in start order.
        root: The staged submission.
        host_seed: Hex; seeds the student's processes by `seed_of`, and reveals nothing about the stimuli.
        duration_ns: How long to observe.
        first_message_on: Topic whose first message starts the observation, or empty.
        wait_at_most_ns: How long to wait for that message.
        clock: `virtual` or `wall`.
        stimuli: What the grader does, in the order of `KINDS`.
        limits: How much the processes may use, and how much is recorded.
        charged: The share of a program's work for which time passes on the virtual clock; otherwise it stands still.
        stop_when_unfit: Whether a run on the virtual clock may end as soon as virtual time is known to be unsuitable.
        starts_ns: Name and start time of the processes that start late.
        may_exit: Names of the processes that may exit.
        shutdown_ns: How long processes may take to end after the stop signal; 0 to send none.
        bare: Whether the files run as with `python3 FILE`, on the wall clock, without the grader's code in their
            processes.
        first_node_ns: When the first node of the bare processes is expected, from which their time is counted.
        starts: What processes are started with, where that is more than their file.
        publishers: The publishers that bare processes are expected to create; the grader subscribes before they do.
        interfaces: Folders of modules of interface packages that are not installed, for the nodes and the grader alike;
            each is in the folder of what was built with it.
        epoch_ns: When virtual time starts, in nanoseconds since 1970.
        uptime_ns: What monotonic clocks show then.
        hash_seed: The PYTHONHASHSEED of the processes; only with 0 they can be forks of one process.
        prefixes: The AMENT_PREFIX_PATH of the nodes, first the folder of what the submission's packages share; empty if
            it has none.
        projects: The ROS packages of the submission, outermost first.
        drawn_order: Whether the order in which processes run that are ready at one instant follows from the seed, and
            that of their callbacks; otherwise it is that of the plan, and of rclpy.
        working: The absolute folder in which the processes start, which then run their files where these lie; empty to
            give each copies and a folder of its own.
        environment: Further variables of the processes.
        begins: What each Python file of the submission starts, by its path, of those that Python can parse.
        connections: The topics on which messages are late or lost.
        measured: How coverage.py measures the lines of the programs, as JSON; empty if nobody measures them. See
            `measure_lines` in the host.
        debugger: Where a debugger of the programs is, as JSON; then nothing ends a program that does not go on. Empty
            without a debugger. See `let_stop` in the host.
        faults: What is done to the programs of a stepped run, and to what they send each other.
        drawn_steps: The steps in which the order is drawn, by their names; None for all of them.
    """

    scenario: str
    processes: tuple[tuple[str, str], ...]
    root: str
    host_seed: str
    duration_ns: int
    first_message_on: str
    wait_at_most_ns: int
    clock: str
    stimuli: tuple[Planned, ...] = ()
    limits: Limits = Limits()
    stop_when_unfit: bool = False
    starts_ns: tuple[tuple[str, int], ...] = ()
    may_exit: tuple[str, ...] = ()
    shutdown_ns: int = 0
    bare: bool = False
    first_node_ns: int = 0
    publishers: tuple[Endpoint, ...] = ()
    interfaces: tuple[str, ...] = ()
    prefixes: tuple[str, ...] = ()
    epoch_ns: int = EPOCH_NS
    uptime_ns: int = UPTIME_NS
    hash_seed: int = 0
    starts: tuple[PlannedStart, ...] = ()
    projects: tuple[Project, ...] = ()
    charged: float = 0.0
    drawn_order: bool = False
    working: str = ""
    environment: tuple[tuple[str, str], ...] = ()
    connections: tuple[PlannedConnection, ...] = ()
    faults: tuple[InjectedFault, ...] = ()
    drawn_steps: tuple[str, ...] | None = None
    begins: tuple[tuple[str, Beginning], ...] = ()
    measured: str = ""
    debugger: str = ""

    def of(self, kind: type[Kind]) -> tuple[Kind, ...]:
        """Return the stimuli of a kind."""
        return tuple(one for one in self.stimuli if isinstance(one, kind))

    def events(self) -> list[Event]:
        """Return what happens, sorted by time, apart from what simulations do."""
        return events_in_order(event for stimulus in self.stimuli for event in stimulus.events())

    def start_of(self, process: str) -> PlannedStart:
        """Return what a process is started with."""
        return next((start for start in self.starts if start.process == process), PlannedStart(process))

    def seed_of(self, process: str) -> str:
        """Return what seeds the randomness of a process, in hex; each has its own, as processes do on any machine.

        Otherwise the clients of two processes would send goals with the same ids, and an action's server would reject
        those of the second one.
        """
        first = not self.processes or process == self.processes[0][0]
        return self.host_seed if first else hashlib.sha256(f"{self.host_seed}/{process}".encode()).hexdigest()

    def scripts_of(self, file: str) -> tuple[tuple[str, str, str], ...]:
        """Return the console scripts of the package that a file is in; none if it is in none."""
        package = layout_of(self.root, file).package
        return next((project.scripts for project in self.projects if project.folder == package), ())

    def is_installed(self, file: str, executable: str) -> bool:
        """Return whether a file is started as its package installs it, as a script, and not by an entry point."""
        package = layout_of(self.root, file).package
        return any(
            executable not in {script for script, _, _ in project.scripts}
            and any(posixpath.join(project.folder, source) == file for _, source in project.programs)
            for project in self.projects
            if project.folder == package
        )

    @property
    def imported(self) -> tuple[str, ...]:
        """The folders of Python packages that CMake installs, relative to the submission."""
        return tuple(posixpath.join(project.folder, path) for project in self.projects for path in project.imported)


@dataclass(frozen=True, slots=True)
class Surroundings:
    """What the runs of a submission have in common besides its files.

    Attributes:
        seed: Determines every drawn value, together with the exercise and the scenario.
        clock: `virtual` or `wall`.
        recordings: The recording of each stimulus that plays one.
        interfaces: Folders of modules of interface packages that are not installed.
        trusted: Those of them that the submission does not bring.
        prefixes: The AMENT_PREFIX_PATH of the nodes, as `install_shares` returns it.
        own_hashes: Whether the hashes of texts in the processes are drawn too, because the order of a set may matter.
    """

    seed: int
    clock: str
    recordings: Mapping[RecordedStream, Recording] = field(default_factory=dict)
    interfaces: tuple[str, ...] = ()
    trusted: tuple[str, ...] = ()
    prefixes: tuple[str, ...] = ()
    own_hashes: bool = False


def plan_scenario(exercise: str, scenario: Scenario, submission: Submission, around: Surroundings) -> Plan:
    """Plan a scenario by drawing every random value in it.

    Args:
        exercise: Id of the exercise.
        scenario: The scenario to plan.
        submission: Provides the files; every process of the scenario must have one.
        around: What the run has besides them.
    """
    seed = around.seed
    purposes = ("stimuli", exercise, scenario.id)
    # each stimulus has its own source of randomness: adding one does not change the others
    drawn = [(s, random.Random(derive(seed, *purposes, str(n)))) for n, s in enumerate(scenario.stimuli)]  # noqa: S311
    course = random.Random(derive(seed, "course", exercise, scenario.id))  # noqa: S311 - it has to repeat
    duration_ns = drawn_time(scenario.span.duration_ns, course)
    until_ns = 0 if scenario.span.after_first_message_on else duration_ns
    shared = random.Random(derive(seed, *purposes))  # noqa: S311 - as above
    stimuli = tuple(
        stimulus.planned(Draws(own, shared, until_ns, around.recordings))
        for kind in KINDS
        for stimulus, own in drawn
        if type(stimulus) is kind  # or one derived from another kind would be played twice
    )
    return Plan(
        scenario=scenario.id,
        processes=tuple((name, _file_of(name, submission)) for name in scenario.processes),
        root=str(submission.root),
        host_seed=derive(seed, "host", exercise, scenario.id),
        duration_ns=duration_ns,
        first_message_on=scenario.span.after_first_message_on or "",
        wait_at_most_ns=scenario.span.wait_at_most_ns,
        clock=around.clock,
        stimuli=stimuli,
        interfaces=around.interfaces,
        prefixes=around.prefixes,
        epoch_ns=EPOCH_NS + _drawn(EPOCH_SPAN_S, seed, "epoch") * NS_PER_S,
        uptime_ns=UPTIME_NS + _drawn(UPTIME_SPAN_S, seed, "uptime") * NS_PER_S,
        hash_seed=1 + _drawn(_HASH_SEEDS, seed, "hashes", exercise, scenario.id) if around.own_hashes else 0,
        limits=scenario.limits,
        starts_ns=tuple((name, drawn_time(t_ns, course)) for name, t_ns in scenario.starts_ns),
        may_exit=scenario.may_exit,
        shutdown_ns=scenario.shutdown_ns,
        starts=tuple(start for name in scenario.processes if (start := _start(name, scenario, submission)) is not None),
        projects=submission.projects,
        begins=tuple((path, read.begins) for path, read in submission.programs.items() if read.begins is not None),
        connections=tuple(
            PlannedConnection(
                one.topic,
                (shortest(one.delay_ns), longest(one.delay_ns)),
                one.lose,
                derive(seed, *purposes, "connection", one.topic),
            )
            for one in scenario.connections
        ),
    )


def _file_of(process: str, submission: Submission) -> str:
    """Return the file of a process in the submission; a launch file of the rubric's own keeps its name."""
    handed_in = submission.files.get(process)
    return (handed_in.found if handed_in is not None else None) or process


def _start(process: str, scenario: Scenario, submission: Submission) -> PlannedStart | None:
    """Return what a process is started with; None if that is its file alone."""
    options = dict(scenario.run).get(process, RunOptions())
    own, handed_in = dict(scenario.provided), submission.files.get(process)
    start = PlannedStart(
        process,
        executable=handed_in.executable if handed_in is not None else "",
        arguments=options.arguments,
        ros_arguments=ros_arguments(options.name, options.namespace, options.remappings, options.parameters),
        parameter_files=tuple(
            (name, _parameters(name, own, submission)) for name in (options.parameters_file,) if name
        ),
        launch_arguments=options.launch_arguments,
        provided=scenario.provided if is_launch_file(process) else (),
        known=tuple(known_programs(submission)) if is_launch_file(process) else (),
    )
    return start if start != PlannedStart(process) else None


def known_programs(submission: Submission) -> Iterator[tuple[str, str]]:
    """Yield the name of each handed-in file by its path in the submission, and by its path and executable."""
    for name, file in submission.files.items():
        if file.found is not None:
            yield (f"{file.found} {file.executable}" if file.executable else file.found), name


def _parameters(name: str, provided: Mapping[str, str], submission: Submission) -> str:
    """Return the text of a parameter file, which the rubric provides or the student has handed in."""
    if name in provided:
        return provided[name]
    found = submission.files[name].found or name
    return (submission.root / found).read_text(encoding="utf-8", errors="replace")


def ros_arguments(
    name: str, namespace: str, remappings: Iterable[tuple[str, str]], parameters: Iterable[tuple[str, str]] = ()
) -> tuple[str, ...]:
    """Return ROS arguments for a node's name and namespace, remappings, and parameters with values in YAML."""
    rules = [*([f"__node:={name}"] if name else []), *([f"__ns:={_absolute(namespace)}"] if namespace else [])]
    rules += [f"{old}:={new}" for old, new in remappings]
    given = [f"{parameter}:={value}" for parameter, value in parameters]
    return (*(part for rule in rules for part in ("-r", rule)), *(part for one in given for part in ("-p", one)))


def _absolute(namespace: str) -> str:
    return namespace if namespace.startswith("/") else f"/{namespace}"


def derive(seed: int, *purpose: str) -> str:
    """Derive 64 hex digits from a seed and a purpose; neither can be recovered from them."""
    text = "/".join((str(seed), *purpose))
    return hashlib.sha256(text.encode()).hexdigest()


#: PYTHONHASHSEED is at most this; 0 would give every process the same hashes.
_HASH_SEEDS = 2**32 - 1


def _drawn(below: int, seed: int, *purpose: str) -> int:
    return int(derive(seed, *purpose)[:16], 16) % below
