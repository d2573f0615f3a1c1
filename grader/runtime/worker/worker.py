"""The trusted worker: runs plans one after another in its own network namespace, and answers each with a trace."""

from __future__ import annotations

import gc
import importlib
import json
import math
import os
import re
import resource
import secrets
import socket
import sys
import time
import traceback
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from contextlib import ExitStack, suppress
from dataclasses import asdict, replace
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING, Any

from grader.runtime.host import machine
from grader.runtime.host.protocol import Stop
from grader.runtime.host.starter import CONNECTED
from grader.runtime.model.errors import HarnessError
from grader.runtime.model.limits import Limits
from grader.runtime.model.quantities import GIB, MIB, NS_PER_S
from grader.runtime.model.scenario import is_launch_file
from grader.runtime.model.trace import AssessedTrace, ClockKind, Delivery, FaultKind, Mark, Message, Observation
from grader.runtime.model.wording import unused_name
from grader.runtime.patience import load_per_processor
from grader.runtime.plan import Plan
from grader.runtime.recording.codec import from_json, observation_to_json, trace_to_json
from grader.runtime.ros_installation import MESSAGE_PACKAGES, PythonRuntime
from grader.runtime.sandbox.environment import QUICK, dds_profile, distro_of, quick_discovery
from grader.runtime.sandbox.protocol import Isolation, StudentProcess
from grader.runtime.sandbox.start import die_with
from grader.runtime.sandbox.starter import HASH_SEED, Starter
from grader.runtime.sandbox.starter_process import StarterProcess
from grader.runtime.sandbox.tiers import IN_PLACE, isolation_from_name
from grader.runtime.simulation.loading import SimulationError
from grader.runtime.steps import COMMANDS, Finish, LaunchFailedError
from grader.runtime.usage import usage, worker_processor_s
from grader.runtime.worker import late_numpy
from grader.runtime.worker.bare_start import BareProcess, bare_arguments
from grader.runtime.worker.beside import files_beside, is_loose, whole_submission
from grader.runtime.worker.conversation import Conversation
from grader.runtime.worker.ending import BLOCKED_S, START_CPU_S, WAKE_UP_CPU_S
from grader.runtime.worker.launch_service import LaunchService
from grader.runtime.worker.launching import MOST, EvaluatedLaunch, evaluated, expanded, renamed, unstarted
from grader.runtime.worker.notes import Places
from grader.runtime.worker.output_watch import OutputWatch
from grader.runtime.worker.resource_monitor import Budget, ResourceMonitor
from grader.runtime.worker.socket_memory import SocketMemory
from grader.runtime.worker.student_process import LOG_FORMAT, NodeProcess

if TYPE_CHECKING:
    from grader.runtime.worker.runner import Runner, StartNode
    from grader.runtime.worker.stepped_runner import LaunchedBesides

#: Real seconds that a program has, on an idle machine, to end after the stop signal and to report what it wrote. Hardly
#: any needs a tenth of it; only one that goes on regardless takes so long.
LAST_REPORT_S = 2.0
#: How often a run on the wall clock is tried if the machine is too busy, before the scenario is undecided.
WALL_TRIES = 3
#: The kernel's limits for the worker, if its resource monitor is too slow: mapped memory, and processor time beyond the
#: monitor's limit. An ordinary worker maps 0.6 GiB.
ADDRESS_SPACE_BYTES, SPARE_CPU_S = 4 * GIB, 5
#: The processor time of a worker for one stepped run, in seconds, so that no test waits for a broken one forever.
STEPPED_CPU_S = 600
#: A worker that uses more memory after a scenario is replaced; ordinary scenarios leave 30 to 50 MiB.
WORN_BYTES = 128 * MIB
#: What a bare process sees of the grader: the module that makes the machine look the same, and how DDS discovers.
MACHINE = Path(machine.__file__).resolve().parent
#: Where it sees that folder, which says nothing of the grader.
MACHINE_SEEN_AT = Path("/opt/student/lib")
#: In sockstat: the TCP sockets in use, and those that only wait for their port to be free again (`tw`).
_CONNECTIONS = re.compile(r"\bTCP6?: inuse (\d+)|\btw (\d+)")


class Worker:
    """Starts students' processes and runs plans with them.

    Args:
        isolation: The tier to start student processes in.
        runtime: Interpreter and ROS.
        executed: The starter for virtual time, which imports rclpy while the first plan is made; None without one.
        can_fork: Whether students' processes are forked; otherwise Python is executed for each.

    Attributes:
        has_started: Whether the submission's code has started since the last plan came.
    """

    def __init__(
        self, isolation: Isolation, runtime: PythonRuntime, executed: StarterProcess | None, *, can_fork: bool
    ) -> None:
        self._isolation = isolation
        self._can_fork = can_fork
        self._runtime = runtime
        self._real_ns = self._starved_ns = 0
        self.has_started = False
        self._starters: dict[str, Starter] = {}
        if executed is not None:
            clock = ClockKind.VIRTUAL.value
            self._starters[clock] = Starter(clock, runtime, isolation.host_seen_at, executed)

    def run(self, plan: Plan, domain: int, left_ns: int, budget_words: str) -> dict[str, Any]:
        """Run one plan and return the answer, with the trace as a value.

        Args:
            plan: The scenario.
            domain: The ROS domain to use.
            left_ns: Real time that is left for the submission.
            budget_words: The reason to give when that is used up.
        """
        self.has_started = False
        if self._remembers_connections():
            raise HarnessError("worker: its network remembers connections of nodes that it recorded before")
        self._real_ns = self._starved_ns = 0
        sys.path += [folder for folder in plan.interfaces if folder not in sys.path]  # installed packages come first
        started_ns = time.monotonic_ns()
        # Virtual time does not depend on how busy the machine is, so that a second try would be the same.
        for _ in range(WALL_TRIES if plan.clock == "wall" else 1):
            # Anew for each try: the limit of the kernel counts from the start of the worker.
            limit_processor_time(own_processor_s(plan))
            spent_ns = time.monotonic_ns() - started_ns
            trace = self._record(plan, domain, Budget(left_ns - spent_ns, budget_words))
            if not trace.harness_problem or time.monotonic_ns() - started_ns > min(plan.limits.wall_ns, left_ns):
                break
        cost = {"real_ns": self._real_ns, "starved_ns": self._starved_ns}
        return {"trace": trace, **cost, "worn": is_worn(trace) or self._remembers_connections()}

    def step(self, plan: Plan, domain: int, other: Conversation) -> bool:
        """Carry out commands until one ends the run; return whether this worker should be replaced.

        Args:
            plan: Limits, seed and clock of the run; what runs in it, commands say.
            domain: The ROS domain to use.
            other: Who sends the commands, and answers questions.
        """
        from grader.runtime.worker.observer import Observer  # noqa: PLC0415 - imports rclpy, which takes long
        from grader.runtime.worker.stepped_clocks import STEPPED  # noqa: PLC0415 - the same

        students: list[NodeProcess] = []
        failed = False

        def start(added: Plan, besides: LaunchedBesides) -> Iterator[tuple[NodeProcess, int]]:
            sys.path += [folder for folder in added.interfaces if folder not in sys.path]  # installed ones come first
            added = self._with_launched(added, domain, {student.name for student in students}, besides)
            besides.start = self._node_starter(added, domain, lambda student: processes.callback(stop_now, student))
            for name, file in added.processes:
                student = self._start(added, name, file, domain)
                processes.callback(stop_now, student)
                _await_ready(student)
                yield student, dict(added.starts_ns).get(name, 0)

        def packed_news() -> list[list[Any]]:
            return [_compact(o) if plan.working else _whole(o) for o in runner.news()]

        def ask(question: Mapping[str, Any]) -> Any:
            return other.ask({**question, "news": packed_news()})  # whoever answers may look at what has happened

        sys.path += [folder for folder in plan.interfaces if folder not in sys.path]
        with ExitStack() as processes, ExitStack() as began:
            limit_processor_time(STEPPED_CPU_S)
            observer = Observer(domain, plan.limits)
            began.callback(observer.close)
            began.enter_context(self._monitor(students, plan, own_s=STEPPED_CPU_S))
            runner = STEPPED[plan.clock](plan, students, observer, start, ask)
            is_real = plan.clock == ClockKind.WALL.value
            if is_real:
                late_numpy.load_numpy()
                began.enter_context(OutputWatch(students, observer.wake, [other.descriptor]))
            other.tell({"now_ns": 0, "news": []})
            for data in other.commands(runner.idle if is_real else None):
                command = from_json(COMMANDS[data["do"]], data["with"])
                if isinstance(command, Finish):
                    runner.look()
                    if plan.measured:  # a program that is killed writes nothing
                        end_in_order(students)
                answer: dict[str, Any] = {"problem": ""}
                try:
                    answer = runner.perform(command)
                except HarnessError as error:
                    answer = {"problem": error.message, "launch_failed": isinstance(error, LaunchFailedError)}
                common = {"now_ns": runner.now_ns, "ended": runner.programs(), "full": runner.full()}
                common["news"] = packed_news()
                common["begun"] = runner.begun()
                is_last = isinstance(command, Finish)
                last = {"notes": runner.notes(), "unsuitable": runner.unsuitable()} if is_last else {}
                other.tell({**answer, **common, **last})
                if is_last:
                    failed = bool(runner.full())
                    break
        odd = not plan.working and (runner.is_odd or self._remembers_connections())
        return failed or odd or usage([os.getpid()]).memory_bytes > WORN_BYTES

    def _node_starter(self, plan: Plan, domain: int, begun: Callable[[NodeProcess], object]) -> StartNode:
        """Return what starts a node that the launch files of a plan describe.

        Args:
            plan: Says how each node is started.
            domain: The ROS domain.
            begun: Called with each process.
        """

        def start(service: LaunchService, node: int, name: str) -> NodeProcess:
            given = replace(plan.start_of(service.processes[node]), process=name)
            under = replace(plan, starts=(given, *plan.starts))
            student = (self._start_bare if plan.bare else self._start)(under, name, service.files[node], domain)
            begun(student)
            if not plan.bare:
                _await_ready(student)
            return student

        return start

    def _with_launched(self, plan: Plan, domain: int, used: Collection[str], besides: LaunchedBesides) -> Plan:
        """Return a plan with the nodes of its launch file, by names that no process has; the plan itself without one.

        Raises HarnessError if the launch file describes nothing that can be started, and fills in what it has besides.
        """
        launch = next(((name, file) for name, file in plan.processes if is_launch_file(name)), None)
        if launch is None:
            return plan
        name, file = launch
        made = self._evaluate(plan, name, file, domain, Budget(plan.limits.wall_ns, ""))
        left_out = besides.left_out
        left_out += [*made.left_out, *(text for text, _ in made.unstarted)]
        if made.harness_problem or made.fault is not None or not made.labels:
            fault = made.fault
            place = name if fault is None or not fault.file else f"{fault.file}:{fault.line}"
            if fault is None and not made.harness_problem:  # the sentences name the place themselves
                raise HarnessError("; ".join([*left_out, *made.notes]))
            why = made.harness_problem or (fault.text if fault is not None else "")
            failed = LaunchFailedError if not made.harness_problem else HarnessError
            raise failed(f"{place}: {why}")
        names: dict[str, str] = {}
        for process, _ in (*made.processes, *made.later):
            label = process.removeprefix(f"{name} ")
            names[process] = unused_name(label, {*used, *names.values()})
        found = expanded(plan, {name: made})
        besides.service = made.service.renamed(names) if made.service is not None else None
        return replace(
            found,
            processes=tuple((names.get(process, process), file) for process, file in found.processes),
            starts=tuple(replace(start, process=names.get(start.process, start.process)) for start in found.starts),
            starts_ns=tuple((names.get(process, process), delay_ns) for process, delay_ns in found.starts_ns),
        )

    def _remembers_connections(self) -> bool:
        """Return whether nodes have left TCP connections in the worker's own network; the grader uses none."""
        return not self._isolation.shares_network and has_connections()

    def _record(self, plan: Plan, domain: int, budget: Budget) -> AssessedTrace:
        launched: dict[str, EvaluatedLaunch] = {}
        started_ns = time.monotonic_ns()
        for name, file in plan.processes:
            if is_launch_file(name):
                launched[name] = self._evaluate(plan, name, file, domain, budget.after(started_ns))
        if any(made.harness_problem for made in launched.values()):
            problem = next(made.harness_problem for made in launched.values() if made.harness_problem)
            return AssessedTrace(
                plan.scenario, ClockKind(plan.clock), stop_ns=0, observations=(), harness_problem=problem
            )
        if any(made.fault is not None or not made.labels for made in launched.values()):
            return unstarted(plan, launched)
        services = [
            (made.service, dict(plan.starts_ns).get(name, 0))
            for name, made in launched.items()
            if made.service is not None
        ]
        recorded = self._record_processes(expanded(plan, launched), domain, budget.after(started_ns), services)
        return renamed(recorded, launched)

    def _evaluate(self, plan: Plan, name: str, file: str, domain: int, budget: Budget) -> EvaluatedLaunch:
        """Return what a launch file describes, which a process in a sandbox of its own evaluates."""
        start = plan.start_of(name)
        packages = [(project.name, project.folder) for project in plan.projects]
        launch = {"arguments": start.launch_arguments, "provided": start.provided, "packages": packages, "most": MOST}
        told = {"launch": launch}
        students: list[NodeProcess] = []
        with ExitStack() as stack:
            stack.callback(stop, students)
            students.append(self._execute(plan, name, file, domain, told))
            monitor = stack.enter_context(self._monitor(students, plan, budget))
            stack.callback(self._account, monitor)
            _await_ready(students[0])
            self.has_started = True
            made = evaluated(students[0], plan)
            return made if made.fault is None else replace(made, harness_problem=monitor.problem)

    def _record_processes(
        self, plan: Plan, domain: int, budget: Budget, services: Sequence[tuple[LaunchService, int]]
    ) -> AssessedTrace:
        students: list[NodeProcess] = []
        with ExitStack() as stack:
            stack.callback(stop, students)
            from grader.runtime.worker.observer import Observer  # noqa: PLC0415 - imports rclpy, which takes long

            if plan.clock == ClockKind.WALL.value:
                # Now, and not in the middle of the run, where its import would hold up the loop.
                late_numpy.load_numpy()

            observer = Observer(domain, plan.limits)  # while the starter is still busy with imports
            stack.callback(observer.close)
            if plan.bare:  # before the program starts: what it sends before anybody subscribes is lost
                observer.subscribe_to_logs()
                observer.watch(plan.publishers)
            for name, file in plan.processes:
                start = self._start_bare if plan.bare else self._start
                students.append(start(plan, name, file, domain))
            monitor = stack.enter_context(self._monitor(students, plan, budget, own_s=own_processor_s(plan)))
            stack.callback(self._account, monitor)
            runner = _import_runners()["bare" if plan.bare else plan.clock]
            if not plan.bare:
                for student in students:
                    _await_ready(student)
            self.has_started = True
            if plan.clock == ClockKind.WALL.value:
                stack.enter_context(OutputWatch(students, observer.wake))
            run = runner(plan, students, observer)
            for service, begins_ns in services:
                run.add_launch(service, self._node_starter(plan, domain, lambda _: None), begins_ns)
            run.fills_machine = lambda: monitor.fills_machine
            trace = monitor.reviewed(run.run())
            if not plan.bare:
                end_in_order(students)
            written = tuple(file for student in students for file in student.written)
            trace = replace(trace, written=written)
            return replace(trace, reached=tuple(dict.fromkeys(what for s in students for what in s.reached)))

    def _monitor(
        self, students: Sequence[NodeProcess], plan: Plan, budget: Budget | None = None, *, own_s: int | None = None
    ) -> ResourceMonitor:
        sockets = SocketMemory(shared=self._isolation.shares_network)
        return ResourceMonitor(students, plan.limits, budget, sockets=sockets, own_s=own_s)

    def _account(self, monitor: ResourceMonitor) -> None:
        self._real_ns += monitor.real_ns
        self._starved_ns += monitor.starved_ns

    def _start(self, plan: Plan, name: str, file: str, domain: int) -> NodeProcess:
        return self._execute(plan, name, file, domain, {})

    def _execute(self, plan: Plan, name: str, file: str, domain: int, told: Mapping[str, Any]) -> NodeProcess:
        """Start a process of the host with a request; the request says if it is to evaluate a launch file."""
        ours, theirs = socket.socketpair()
        process = StudentProcess(
            runtime=_with_packages(self._runtime, plan),
            host_folder=Path(__file__).resolve().parents[1] / "host",
            submission=Path(plan.root),
            arguments=(),
            environment={
                "ROS_DOMAIN_ID": str(domain),
                "RCUTILS_COLORIZED_OUTPUT": "0",
                **quick_discovery(self._isolation.host_seen_at, self._runtime, plan.clock),
                "PYTHONHASHSEED": str(plan.hash_seed),
                **dict(plan.environment),
            },
            pass_fds=(theirs.fileno(),),
            working=plan.working or None,
            installed=_installed(plan, name),
        )
        process = process if told or plan.working else with_copies(process, file, plan.limits)
        root = self._isolation.submission_of(process)
        start = plan.start_of(name)
        request = {
            "root": root,
            "file": file,
            "executable": start.executable,
            "arguments": start.arguments,
            "ros_arguments": start.ros_arguments,
            "parameter_files": start.copied_files,
            "scripts": plan.scripts_of(file),
            "installed": plan.is_installed(file, start.executable),
            "imported": plan.imported,
            "seed": plan.seed_of(name),
            "clock": plan.clock,
            "charged": plan.charged,
            "drawn_order": plan.drawn_order,
            "in_place": bool(plan.working),
            "measured": json.loads(plan.measured) if plan.measured else None,
            "steady_ns": plan.epoch_ns - plan.uptime_ns,
            "log_format": LOG_FORMAT,
            "python_paths": [str(p) for p in self._runtime.python_paths],
            "interfaces": plan.interfaces,
            "debugger": json.loads(plan.debugger) if plan.debugger else None,
            "limits": {"start_cpu_s": START_CPU_S, "wake_up_cpu_s": WAKE_UP_CPU_S, "blocked_s": BLOCKED_S},
            **told,
        }
        launcher = f"{self._isolation.host_seen_at}/launcher.py"
        arguments = ("-s", "-u", "-B", "-X", "utf8", launcher, json.dumps({**request, "fd": theirs.fileno()}))
        process = replace(process, arguments=arguments)
        try:
            # a fork of the starter has imported rclpy, which takes no part, and has the hashes of the starter
            if told or not self._can_fork or str(plan.hash_seed) != HASH_SEED:
                command = self._isolation.student_command(process, plan.limits)
                environment = command.environment
                student = NodeProcess.start(name, root, command, ours, plan.limits)
            else:
                sandbox = self._isolation.prepared_sandbox(process, plan.limits)
                environment = sandbox.environment
                executed = (str(self._runtime.executable), *arguments[:-1], json.dumps({**request, "fd": CONNECTED}))
                started = self._starter(plan.clock).start(sandbox, request, executed, theirs)
                student = NodeProcess.started(name, root, started, ours, plan.limits)
        except OSError:
            ours.close()
            raise
        finally:
            theirs.close()
        student.file, student.places, student.arguments = file, Places(Path(plan.root)), start.words
        student.own_folder, student.keeps_paths = _own_folder(environment), bool(plan.working)
        student.silence_s = math.inf if plan.debugger else student.silence_s
        student.launched_by, student.prefix = start.launched_by, next(iter(plan.prefixes), "")
        student.given = start.given_parameters, start.given_remappings
        return student

    def _starter(self, clock: str) -> Starter:
        if clock not in self._starters:
            self._starters[clock] = Starter(clock, self._runtime, self._isolation.host_seen_at)
        return self._starters[clock]

    def _start_bare(self, plan: Plan, name: str, file: str, domain: int) -> NodeProcess:
        """Start a file without the grader's code in its process."""
        runtime = _with_packages(self._runtime, plan)
        own = MACHINE if self._isolation.submission_seen_at == IN_PLACE else MACHINE_SEEN_AT
        # nothing in its process could add to sys.path, so these folders come before the installed packages
        searched = (*runtime.python_paths, *plan.interfaces, own)
        process = StudentProcess(
            runtime=runtime,
            host_folder=MACHINE,  # nothing else of the grader
            host_at=MACHINE_SEEN_AT,
            submission=Path(plan.root),
            arguments=(),
            environment={
                "ROS_DOMAIN_ID": str(domain),
                "PYTHONPATH": os.pathsep.join(map(str, searched)),
                **dds_profile(own, QUICK, distro_of(self._runtime.environment)),
            },
            pass_fds=(),
            installed=_installed(plan, name),
        )
        process = with_copies(process, file, plan.limits)
        root = self._isolation.submission_of(process)
        start = plan.start_of(name)
        arguments = bare_arguments(
            Path(plan.root),
            root,
            file,
            dict(plan.begins).get(file),
            start,
            plan.scripts_of(file),
            installed=plan.is_installed(file, start.executable),
            imported=plan.imported,
        )
        command = self._isolation.student_command(replace(process, arguments=arguments), plan.limits)
        student = BareProcess.begin(name, root, command, plan.limits)
        student.own_folder = _own_folder(command.environment)
        student.file, student.places = file, Places(Path(plan.root))
        student.prefix = next(iter(plan.prefixes), "")
        return student


def with_copies(process: StudentProcess, file: str, limits: Limits) -> StudentProcess:
    """Return a process that may write to a copy of its submission; of a large one, to copies of the files beside it.

    Args:
        process: The process.
        file: The program that it runs, relative to the submission.
        limits: How much the copy may hold.
    """
    root = process.submission
    folder = str(PurePosixPath(file).parent)
    whole = whole_submission(root, limits.scratch_bytes)
    if whole is None:
        return replace(process, beside=root / folder, copied=files_beside(root, file))
    working = folder.removeprefix(".") if is_loose(root, file) else None
    own = secrets.token_hex(8)
    return replace(process, beside=root, copied=whole, writable=True, working=working, own=own)


def _own_folder(environment: Mapping[str, str]) -> str:
    """Return the folder that an environment names for temporary files; empty if there is none."""
    return environment.get("TMPDIR", "")


def _installed(plan: Plan, name: str) -> Path | None:
    """Return the prefix of the packages for a process that a launch file started, and may have told where it is."""
    started = bool(plan.start_of(name).launched_by and plan.prefixes)
    return Path(plan.prefixes[0]) if started else None


def _with_packages(runtime: PythonRuntime, plan: Plan) -> PythonRuntime:
    """Return a runtime whose processes also find what was built or installed for a plan."""
    own = (*(Path(folder).parent for folder in plan.interfaces), *map(Path, plan.prefixes[:1]))
    path = {"AMENT_PREFIX_PATH": ":".join(plan.prefixes)} if plan.prefixes else {}
    return replace(runtime, read_paths=(*runtime.read_paths, *own), environment={**runtime.environment, **path})


def _import_runners() -> Mapping[str, Callable[..., Runner]]:
    """Import rclpy, which the supervisor never does, and return what runs a plan by its clock, or `bare`."""
    from grader.runtime.worker.bare_runner import BareRunner  # noqa: PLC0415
    from grader.runtime.worker.virtual_runner import VirtualRunner  # noqa: PLC0415
    from grader.runtime.worker.wall_runner import WallRunner  # noqa: PLC0415

    return {"virtual": VirtualRunner, "wall": WallRunner, "bare": BareRunner}


def _import_interfaces() -> None:
    """Import the common message packages, and load their type supports."""
    for package in MESSAGE_PACKAGES:
        for message in list(vars(importlib.import_module(f"{package}.msg")).values()):
            if hasattr(message, "__import_type_support__"):
                message.__import_type_support__()


def limit_memory() -> None:
    """Set the kernel's limit on the memory that this process may map; students' processes have their own."""
    _, most = resource.getrlimit(resource.RLIMIT_AS)
    resource.setrlimit(resource.RLIMIT_AS, (_lower(ADDRESS_SPACE_BYTES, most), most))


def own_processor_s(plan: Plan) -> int:
    """Return the most processor time of this process for one plan, in seconds."""
    return worker_processor_s(plan.limits, plan.duration_ns + plan.wait_at_most_ns)


def limit_processor_time(limit_s: int) -> None:
    """Set the kernel's limit on the processor time of this process, counted from now, beyond its monitor's limit."""
    _, most = resource.getrlimit(resource.RLIMIT_CPU)
    seconds = math.ceil(time.process_time_ns() / NS_PER_S) + limit_s + SPARE_CPU_S
    resource.setrlimit(resource.RLIMIT_CPU, (_lower(seconds, most), most))


def _lower(value: int, most: int) -> int:
    return value if most == resource.RLIM_INFINITY else min(value, most)


def is_worn(trace: AssessedTrace) -> bool:
    """Return whether a worker should be replaced after a scenario: something unusual happened, or it has grown."""
    odd = any(f.kind in (FaultKind.KILLED, FaultKind.HUNG) for f in trace.faults()) or trace.notes or trace.incomplete
    full = any(isinstance(o, Mark) and o.name == "limit" for o in trace.observations)
    return bool(odd or full or trace.harness_problem) or usage([os.getpid()]).memory_bytes > WORN_BYTES


def has_connections() -> bool:
    """Return whether this network has TCP connections: the kernel keeps the ports of closed ones for a minute.

    The counts are those of proc_net(5), `sockstat`; a list of the connections takes the kernel much longer.
    """
    counted = ""
    for name in ("sockstat", "sockstat6"):
        with suppress(OSError):
            counted += Path(f"/proc/net/{name}").read_text(encoding="ascii")
    return any(int(used or waiting) for used, waiting in _CONNECTIONS.findall(counted))


def _await_ready(student: NodeProcess) -> None:
    """Wait until a process is about to run its file; none of the student's code has run until then."""
    if not student.is_ready():
        raise RuntimeError(f"a student's process did not start: {student.stopped or _last_words(student)}")


def _last_words(student: NodeProcess) -> str:
    student.drain()
    words = [one.text for one in student.output(0, final=True)]
    return " | ".join(words[-3:])[:500] or "no output"


def end_in_order(students: list[NodeProcess]) -> None:
    """Send the stop signal to every running process, and take what it reports at its end."""
    running = [student for student in students if not student.ended]
    for student in running:
        student.tell(Stop())
    for student in running:
        student.last_report(LAST_REPORT_S * load_per_processor())


def stop_now(student: NodeProcess) -> None:
    """Kill a process that nobody will ask anything any more."""
    student.end_now()
    student.close()


def _compact(observation: Observation) -> list[Any]:
    """Convert an observation for the other side of a run of own programs, which reads messages from their bytes."""
    if isinstance(observation, (Message, Delivery)) and observation.cdr:
        return observation_to_json(replace(observation, value={}))
    return observation_to_json(observation)


def _whole(observation: Observation) -> list[Any]:
    """Convert an observation for a rubric's test, with the fields of what the test has published as bytes."""
    if isinstance(observation, Delivery) and not observation.value:
        from grader.runtime.serialization import carried_fields  # noqa: PLC0415 - imports rclpy, which takes long

        observation = replace(observation, value=carried_fields(observation))
    return observation_to_json(observation)


def stop(students: list[NodeProcess]) -> None:
    """Send the stop signal to every running process, wait briefly, then kill it."""
    for student in students:
        if not student.ended:
            student.tell(Stop())
    for student in students:
        student.kill()
        student.close()


def serve(request: Mapping[str, Any], executed: StarterProcess | None) -> None:
    """Run plans until the supervisor closes the socket.

    Args:
        request: `isolation`, `runtime` and `can_fork`; `line`, the number of the socket; and `lines_of_forks`, those of
            forks that serve too.
        executed: See `Worker`.
    """
    limit_memory()
    runtime = from_json(PythonRuntime, request["runtime"])
    worker = Worker(isolation_from_name(request["isolation"]), runtime, executed, can_fork=request["can_fork"])
    with suppress(Exception):  # the first plan raises it again, and answers with it
        # here, because the starter and the supervisor are still busy with imports as well, and forks share it
        _import_runners()
        _import_interfaces()
    line = _own_line([request["line"], *request["lines_of_forks"]])
    answers = line.makefile("w")
    commands = map(json.loads, line.makefile("r"))

    def tell(answer: Mapping[str, Any]) -> None:
        answers.write(json.dumps(answer) + "\n")
        answers.flush()

    for data in commands:
        if "stepped" in data:
            try:
                worn = worker.step(from_json(Plan, data["stepped"]), data["domain"], Conversation(line, commands, tell))
            except Exception:
                tell({"failed": traceback.format_exc()[-4000:]})
                return  # the other side takes another worker
            tell({"worn": worn})
            continue
        try:
            plan: Plan = from_json(Plan, data["plan"])
            answer: dict[str, Any] = worker.run(plan, data["domain"], data["left_ns"], data["budget"])
        except SimulationError as error:
            answer = {"problem": error.message, "author_mistake": asdict(error.mistake)}
        except HarnessError as error:
            answer = {"problem": error.message, "has_started": worker.has_started}
        except Exception:
            answer = {"problem": traceback.format_exc()[-4000:], "has_started": worker.has_started}
        answers.writelines(answer_parts(answer))
        answers.flush()


def answer_parts(answer: Mapping[str, Any]) -> Iterator[str]:
    """Yield the parts of the JSON line of an answer; a large trace would take several times its memory as a whole."""
    trace = answer.get("trace")
    if trace is None:
        yield json.dumps(answer) + "\n"
        return
    head = trace_to_json(replace(trace, observations=()), aside=True)
    del head["observations"]
    yield json.dumps({name: value for name, value in answer.items() if name != "trace"})[:-1]
    yield f', "trace": {json.dumps(head)[:-1]}, "observations": ['
    for number, observation in enumerate(trace.observations):
        yield (", " if number else "") + json.dumps(observation_to_json(observation))
    yield "]}}\n"


def _own_line(lines: Sequence[int]) -> socket.socket:
    """Make a fork for each line but the first, and return the socket to the supervisor of this process."""
    own, *others = lines
    parent = os.getpid()
    if others:
        gc.freeze()
    for line in others:
        if not os.fork():
            die_with(parent)
            for number in {*lines} - {line}:  # or the supervisor would not see the end of another worker
                with suppress(OSError):
                    os.close(number)
            connection = socket.socket(fileno=line)
            connection.send(b"\n")
            return connection
        os.close(line)
    return socket.socket(fileno=own)
