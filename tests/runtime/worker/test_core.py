"""The rules of virtual time, by their numbers in docs/explanation/rules.md; core and clock touch nothing here."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable
from types import SimpleNamespace
from typing import Any

import pytest

from grader.runtime.host import virtual
from grader.runtime.host.clock import AHEAD_NS, EPOCH_NS, LATE_NS, LOOK_NS, TASKS_AT_ONCE, VirtualClock
from grader.runtime.host.protocol import ORDINARY, Answer, Claim, Go, Idle, Stop
from grader.runtime.host.ros_state import RosState
from grader.runtime.host.scheduler import GreenThread, Scheduler
from grader.runtime.host.virtual import STOPPING_NS, VirtualTime
from grader.runtime.model.scenario import Event
from grader.runtime.stimuli.calls import Ask, PlannedCall, PlannedCalls
from grader.runtime.stimuli.events import Appear, Disappear
from grader.runtime.worker.core import (
    HOP_NS,
    HOPS,
    MOST_HOPS,
    STEPS,
    STEPS_HZ,
    Agenda,
    Arriving,
    Command,
    Core,
    Limit,
    Play,
    Process,
    Receive,
    Retry,
    RunProcess,
    Taken,
)
from grader.runtime.worker.delay import HOPELESS_NS, Delay

MS = 1_000_000
S = 1_000 * MS
FLOAT, INT = "std_msgs/msg/Float32", "std_msgs/msg/Int32"
CALLS = PlannedCalls("/ask", "std_srvs/srv/Trigger", 0, 0, 1, ({}, {}))

#: What a process does when it runs: it tells the core what has happened.
Does = Callable[[RunProcess[Process]], object]


class Played:
    """A run of processes that are functions: carries out commands by noting them, with their virtual milliseconds."""

    def __init__(
        self,
        *names: str,
        due: Iterable[Event] = (),
        starts_ms: dict[str, int] | None = None,
        end_ms: int = 1000,
        **options: Any,
    ) -> None:
        self.processes = [Process(name) for name in names]
        self.agenda = Agenda(due, {name: at * MS for name, at in (starts_ms or {}).items()}, end_ms * MS)
        self.core = Core(self.processes, self.agenda, **options)
        self.done: list[str] = []
        self.runs: list[RunProcess[Process]] = []
        self.does: dict[str, Does] = {}
        self.during: Callable[[Command[Process]], object] = lambda command: None

    def __getitem__(self, name: str) -> Process:
        return next(process for process in self.processes if process.name == name)

    def play(self, commands: Iterable[Command[Process]]) -> list[str]:
        """Carry out commands, and return what was done."""
        for command in commands:
            self.done.append(f"{self.core.now_ns / MS:g} {self.words(command)}")
            self.during(command)
            if isinstance(command, RunProcess):
                self.runs.append(command)
                self.core.waits(command.process, None)  # unless it does something else
                if does := self.does.get(command.process.name):
                    does(command)
        return self.done

    def whole(self) -> list[str]:
        """Play the run from its beginning to its end, and return its events."""
        self.play(self.core.begin())
        self.play(self.core.run_on())
        return self.events()

    def events(self) -> list[str]:
        """Return what was done, without looks for counterparts."""
        return [line for line in self.done if not line.endswith("retry")]

    def wakes(self, name: str, *moments_ms: float) -> None:
        """Let a process wake at some moments in turn."""
        left = [round(at * MS) for at in moments_ms]
        self.does[name] = lambda run: self.core.waits(run.process, left.pop(0) if left else None)

    @staticmethod
    def words(command: Command[Process]) -> str:
        match command:
            case Play():
                event = command.event
                what = event.call.index if isinstance(event, Ask) else getattr(event, "topic", "")
                return f"{type(event).__name__} {what}"
            case RunProcess():
                return " ".join([command.process.name, *(f"{n} {c}" for c, n in command.arrivals.items())])
            case Receive():
                return f"{command.process.name} receives {dict(command.arrivals)}"
            case Retry():
                return "retry"
            case Limit():
                return f"limit: {command.why}"


def claim(kind: str, name: str, interface: str = FLOAT, number: int = 0, **qos: Any) -> Claim:
    return Claim(kind, name, interface, number, ORDINARY._replace(**qos))


def stop(at_ms: float, topic: str = "/x") -> Disappear:
    """Return an event that creates nothing."""
    return Disappear(round(at_ms * MS), topic)


# ------------------------------------------------------------------ who may move the clock


@pytest.mark.rule(1)
def test_the_clock_of_a_process_never_goes_back() -> None:
    """Whatever it is told; and the worker does not go back for what a process says either."""
    clock = VirtualClock()
    clock.move_to(EPOCH_NS + 5)
    clock.move_to(EPOCH_NS + 3)
    assert clock.now_ns == EPOCH_NS + 5
    run = Played("a", end_ms=100)
    run.wakes("a", 50)
    run.play(run.core.begin())
    run.core.now_ns = 40 * MS
    run.core.reached(30 * MS)
    assert run.core.now_ns == 40 * MS


class Host:
    """A host's side of virtual time: a grader that answers by a script, and nothing of the process replaced."""

    def __init__(self, *answers: Answer) -> None:
        self.used_ns = 0
        self.killed: list[int] = []
        self.answers = list(answers)
        self.reports: list[Idle] = []
        real = SimpleNamespace(
            processor_ns=lambda: self.used_ns,
            perf_counter=lambda: 0.0,
            sleep=lambda _: None,
            kill=lambda pid, signal: self.killed.append(signal),
        )
        self.time = VirtualTime(self, real)  # type: ignore[arg-type]

        def ignored(*_: Any) -> None:
            """Do nothing."""

        self.endpoints = SimpleNamespace(changed=False, removed=False, claims=lambda _: [])
        self.outbox = SimpleNamespace(
            sent=Counter(), early=Counter(), sending=False, note_waited=ignored, settled=ignored
        )
        inbox = SimpleNamespace(lost=Counter(), expect=ignored)
        graph = SimpleNamespace(sees_graph=False, is_timed=False)
        told = {"events": SimpleNamespace(), "note": self.time.order.note}
        self.time._ros = RosState(self.endpoints, self.outbox, inbox, graph, **told)  # type: ignore[arg-type]
        self.time._move_to(EPOCH_NS)

    def ask(self, report: Idle) -> Answer:
        """Answer as the script says, and afterwards let the process do what it wants."""
        self.reports.append(report)
        wake_ns = report.wake_ns or 0
        return self.answers.pop(0) if self.answers else Go(wake_ns, wake_ns)

    def waits_until(self, at_ms: float) -> float:
        """Let the program wait until a moment; return the time that it has afterwards, in milliseconds."""
        self.time._ask_for_time(EPOCH_NS + round(at_ms * MS))
        return (self.time.clock.now_ns - EPOCH_NS) / MS


def answer(now_ms: int, free_until_ms: int) -> Go:
    return Go(EPOCH_NS + now_ms * MS, EPOCH_NS + free_until_ms * MS)


@pytest.mark.rule(2)
def test_a_process_goes_on_alone_before_the_moment_that_it_was_told() -> None:
    """At that moment something else may happen first, so it asks."""
    host = Host(answer(10, 50))
    assert [host.waits_until(at) for at in (10, 20, 49.999999)] == [10, 20, 49.999999]
    assert len(host.reports) == 1
    host.waits_until(50)
    assert [report.progress.now_ns for report in host.reports[1:]] == [EPOCH_NS + 49_999_999]


@pytest.mark.rule(2)
@pytest.mark.parametrize("news", ["sent", "changed", "written", "worked"])
def test_a_process_that_has_something_to_report_does_not_go_on_alone(news: str) -> None:
    """A message, a text, an endpoint, or more work than a few polls cost."""
    host = Host(answer(10, 500))
    host.waits_until(10)
    host.waits_until(20)
    assert len(host.reports) == 1
    if news == "sent":
        host.outbox.sent["topic /x"] = 1
    elif news == "written":
        host.time.unreported = True
    elif news == "changed":
        host.endpoints.changed = True
    else:
        host.used_ns += virtual.MOST_WORK_NS
    host.waits_until(30)
    assert len(host.reports) == 2


@pytest.mark.rule(2)
def test_a_process_goes_on_alone_ten_times_in_a_row() -> None:
    """Then the worker measures what it has worked."""
    host = Host(answer(1, 500))
    for at in range(1, 13):
        host.waits_until(at)
    assert [report.progress.moved for report in host.reports] == [0, 10]


@pytest.mark.rule(2)
def test_a_process_is_free_until_a_stimulus_or_another_process_is_due() -> None:
    """Or until the end; who has messages on the way to it is due now, and who has ended never is."""
    run = Played("a", "b", due=[stop(300)])
    run.does["a"] = lambda _: run.core.waits(run["a"], 50 * MS)
    run.play(run.core.begin())
    assert [(one.process.name, one.free_until_ns / MS) for one in run.runs] == [("a", 300), ("b", 50)]
    free_ms = []
    for change in (
        run.agenda.due.clear,
        lambda: run.core.waits(run["b"], 400 * MS),
        lambda: run["b"].arrivals.update({"topic /x": 1}),
        lambda: run.core.ended(run["b"]),
    ):
        change()
        run.play(run.core.run(run["a"]))
        free_ms.append(run.runs[-1].free_until_ns / MS)
    assert free_ms == [1000, 400, 0, 1000]


@pytest.mark.rule(3)
def test_the_time_that_a_process_has_reached_is_adopted_but_not_beyond_what_it_was_let() -> None:
    """What it reports then is recorded with this time."""
    run = Played("a", "b")
    run.wakes("b", 70)
    reached_ms = []

    def goes_on(_: RunProcess[Process]) -> None:
        for at in (40, 10**6):
            run.core.reached(at * MS)
            reached_ms.append(run.core.now_ns / MS)

    run.play(run.core.begin())
    run.does["a"] = goes_on
    run.play(run.core.run(run["a"]))
    assert reached_ms == [40, 70]


@pytest.mark.rule(4)
def test_after_the_final_stop_the_clock_of_a_process_runs_alone_for_a_minute() -> None:
    """Without a report, and then it stands."""
    host = Host(Stop())
    host.waits_until(10)
    assert len(host.killed) == len(host.reports) == 1
    seconds = STOPPING_NS // S
    assert [host.waits_until(at * 1000) for at in (1, seconds, seconds + 1)] == [1000, 60_000, 60_000]
    assert len(host.reports) == 1


# ------------------------------------------------------------- what runs inside one process


@pytest.mark.rule(6)
def test_the_next_thread_is_chosen_in_one_order() -> None:
    """Runnable, stood back after a text, polling, due; then the worker is asked, with the earliest deadline."""
    asked: list[int | None] = []
    now_ns = 100

    def ask(wake_ns: int | None) -> None:
        nonlocal now_ns
        asked.append(wake_ns)
        now_ns = wake_ns or now_ns

    scheduler = Scheduler(lambda: now_ns, ask)
    names = {name: GreenThread() for name in ("second", "first", "stood back", "polls", "due late", "due", "later")}
    scheduler._runnable.extend([names["first"], names["second"]])
    scheduler._last.append(names["stood back"])
    for name, deadline_ns in (("later", 300), ("due late", 90), ("due", 80), ("polls", None)):
        thread = names[name]
        thread.parked, thread.deadline_ns, thread.polls = True, deadline_ns, name == "polls"
        scheduler._parked.append(thread)
    chosen = [scheduler._choose() for _ in names]
    named = [name for thread in chosen for name, one in names.items() if one is thread]
    assert named == ["first", "second", "stood back", "polls", "due", "due late", "later"]
    assert asked == [300]


@pytest.mark.rule(6)
def test_a_thread_that_polls_runs_again_only_after_something_has_happened() -> None:
    """Otherwise it would poll for ever at one instant."""
    asked: list[int | None] = []
    scheduler = Scheduler(lambda: len(asked), asked.append)
    polls = GreenThread()
    polls.parked, polls.polls, polls.deadline_ns = True, True, 1
    polls.polled_in = scheduler._round
    scheduler._parked.append(polls)
    assert scheduler._choose() is polls
    assert asked == [1]
    polls.parked, polls.polled_in = True, scheduler._round
    scheduler._parked.append(polls)
    scheduler.progress()
    assert scheduler._choose() is polls
    assert asked == [1]


@pytest.fixture
def passing() -> tuple[VirtualClock, list[int]]:
    """A clock, and the time that has passed each time that it let some pass, in nanoseconds."""
    clock, passed = VirtualClock(), []

    def let_time_pass(until_ns: int) -> None:
        passed.append(until_ns - clock.now_ns)
        clock.move_to(until_ns)

    clock.let_time_pass = let_time_pass
    return clock, passed


@pytest.mark.rule(7)
def test_time_passes_for_a_program_that_only_looks_at_a_clock(passing: tuple[VirtualClock, list[int]]) -> None:
    """After 200 looks at one instant, and from then on at each 5th, by half a millisecond."""
    clock, passed = passing
    looks = []
    for number in range(1, 221):
        before = len(passed)
        clock.look()
        looks += [number] if len(passed) > before else []
    assert looks == [201, 206, 211, 216]
    assert set(passed) == {MS // 2}


@pytest.mark.rule(7)
def test_time_passes_faster_for_a_program_that_only_polls(passing: tuple[VirtualClock, list[int]]) -> None:
    """By 10 ms, but not beyond the next timer, and not while one is due."""
    clock, passed = passing
    for _ in range(201):
        clock.idle_look()
    assert passed == [10 * MS]
    clock.timers_due_in_ns = lambda: [3 * MS, 8 * MS]
    for _ in range(5):
        clock.idle_look()
    assert passed == [10 * MS, 3 * MS]
    clock.timers_due_in_ns = lambda: [0]
    for _ in range(5):
        clock.idle_look()
    assert len(passed) == 2


@pytest.mark.rule(7)
def test_time_passes_after_many_messages_and_after_many_looks_between_other_things(
    passing: tuple[VirtualClock, list[int]],
) -> None:
    """200 and 400; a program that paces itself is far below."""
    clock, passed = passing
    for _ in range(199):
        clock.busy_sending()
    assert passed == []
    clock.busy_sending()
    assert len(passed) == 1
    for _ in range(AHEAD_NS // LOOK_NS):
        clock.look()
        clock.busy()
    assert len(passed) == 1
    clock.look()
    clock.look()
    assert len(passed) == 2


@pytest.mark.rule(7)
def test_tasks_that_end_at_one_instant_are_work_up_to_a_number(passing: tuple[VirtualClock, list[int]]) -> None:
    """Beyond it they only create each other, and looks between them add up."""
    clock, passed = passing
    for _ in range(TASKS_AT_ONCE):
        clock.idle_look()
        clock.end_task()
    assert passed == []
    for _ in range(201):
        clock.idle_look()
        clock.end_task()
    assert len(passed) == 1


@pytest.mark.rule(8)
def test_a_pause_of_a_program_that_looks_at_clocks_ends_late() -> None:
    """By a microsecond, and only there; a look of a library is none."""
    clock = VirtualClock()
    assert clock.end_of(10 * MS) == EPOCH_NS + 10 * MS
    clock.look(paces=False, shown=False)
    assert clock.end_of(10 * MS) == EPOCH_NS + 10 * MS
    clock.look()
    assert clock.end_of(10 * MS) == EPOCH_NS + 10 * MS + LATE_NS == EPOCH_NS + 10 * MS + 1000


# ------------------------------------------------------------------ what happens at one instant


@pytest.mark.rule(9)
def test_stimuli_come_before_the_processes_of_their_instant() -> None:
    """All that are due, and again after each process, because it may have caused more."""
    run = Played("a", "b", due=[stop(100, "/x"), stop(100, "/y")])
    run.wakes("a", 100)
    run.wakes("b", 100)

    def causes(command: Command[Process]) -> None:
        if isinstance(command, RunProcess) and command.process.name == "a" and run.core.now_ns:
            run.agenda.later(stop(100, "/z"))

    run.during = causes
    assert run.whole()[2:] == ["100 Disappear /x", "100 Disappear /y", "100 a", "100 Disappear /z", "100 b"]


@pytest.mark.rule(9)
def test_calls_are_made_one_at_a_time() -> None:
    """The next one follows when this one has arrived, so that their order is always the same."""
    asks = [Ask(100 * MS, PlannedCall(CALLS, index)) for index in (0, 1)]
    run = Played("server", due=[*asks, stop(100)])
    run.during = lambda command: (
        run.core.exchanged("request", "/ask", 1) if isinstance(command, Play) and isinstance(command.event, Ask) else 0
    )
    run.core.has(run["server"], [claim("service", "/ask", CALLS.type)])
    assert run.whole()[1:] == [
        "100 Ask 0",
        "100 server 1 request /ask",
        "100 Ask 1",
        "100 server 1 request /ask",
        "100 Disappear /x",
    ]


@pytest.mark.rule(9)
def test_what_exists_from_the_start_is_created_before_any_program_runs() -> None:
    """And nothing else: a message at the first instant comes after the programs have begun."""
    run = Played("a", "late", due=[Appear(0, "/x", FLOAT), stop(0)], starts_ms={"late": 200})
    assert run.whole() == ["0 Appear /x", "0 a", "0 Disappear /x", "200 late"]
    assert [one.starts for one in run.runs] == [False, True]


@pytest.mark.rule(10)
def test_one_process_runs_at_a_time_and_the_first_of_the_plan_first() -> None:
    """For whichever of three reasons: messages on their way, a match, or the time that it waits for."""
    run = Played("arrivals", "nudged", "due", "waits", "ended")
    run.play(run.core.begin())
    run.done.clear()
    run["arrivals"].arrivals = {"topic /x": 2}
    run["nudged"].nudged = True
    run["due"].wake_ns = 0
    run["waits"].wake_ns = 1
    run["ended"].nudged = run["ended"].ended = True
    under_way: list[str] = []

    def alone(command: Command[Process]) -> None:
        assert not under_way
        if isinstance(command, RunProcess):
            under_way.append(command.process.name)

    run.during = alone
    for process in run.processes:
        run.does[process.name] = lambda _: under_way.clear()
    run.play(run.core.run_on())
    assert run.events() == [
        "0 arrivals 2 topic /x",
        "0 nudged",
        "0 due",
        "1e-06 waits",
    ]


@pytest.mark.rule(10)
def test_a_process_that_comes_earlier_in_the_plan_goes_first_again() -> None:
    """After each process the choice begins anew."""
    run = Played("a", "b", "c")
    run.play(run.core.begin())
    run.done.clear()
    run["b"].nudged = run["c"].nudged = True
    run.does["b"] = lambda _: setattr(run["a"], "nudged", True)
    run.play(run.core.run_on())
    assert run.done[:3] == ["0 b", "0 a", "0 c"]


def answering(run: Played) -> None:
    """Let a process answer each message to it with another one to it, for ever."""
    run.core.has(run["a"], [claim("publisher", "/x"), claim("subscription", "/x")])
    run.does["a"] = lambda _: run.core.sent(run["a"], {"topic /x": 1})


@pytest.mark.rule(10)
def test_nodes_that_answer_each_other_without_a_rest_end_the_run() -> None:
    """200 messages at one instant are free, each further one takes 0.25 ms, and 4,000 are the end."""
    run = Played("a", end_ms=10_000)
    answering(run)
    times = []

    def note(command: Command[Process]) -> None:
        if isinstance(command, Limit):
            run.agenda.end_by(run.core.now_ns)
        elif isinstance(command, RunProcess) and command.arrivals:
            times.append(run.core.now_ns)

    run.during = note
    run.whole()
    assert (HOPS, HOP_NS, MOST_HOPS) == (200, MS // 4, 4_000)
    assert times[: HOPS + 3] == [0] * HOPS + [HOP_NS, 2 * HOP_NS, 3 * HOP_NS]
    limits = [line for line in run.done if "limit" in line]
    assert limits == ["950.25 limit: the nodes answered each other 4,000 times without a pause"]


@pytest.mark.rule(10)
def test_time_that_a_process_lets_pass_in_its_own_step_is_a_rest() -> None:
    """However often it hears a message, also its own."""
    run = Played("a", end_ms=10_000)
    answering(run)
    answers = run.does["a"]

    def rests(one: RunProcess[Process]) -> None:
        run.core.reached(run.core.now_ns + MS)
        answers(one)

    run.does["a"] = rests
    run.whole()
    assert len(run.runs) == pytest.approx(10_000, abs=2)
    assert not [line for line in run.done if "limit" in line]


@pytest.mark.rule(10)
def test_an_instant_at_which_nothing_is_left_to_do_is_a_rest() -> None:
    """Nodes may answer each other 200 times at the next one again."""
    run = Played("a", end_ms=50 * 2 * MOST_HOPS // HOPS)
    answering(run)
    answers = run.does["a"]

    def rests_after_some(one: RunProcess[Process]) -> None:
        if len(run.runs) % HOPS:
            answers(one)
        else:
            run.core.waits(run["a"], run.core.now_ns + 50 * MS)

    run.does["a"] = rests_after_some
    run.whole()
    assert len(run.runs) == 2 * MOST_HOPS
    assert not [line for line in run.done if "limit" in line]
    assert not run.core.is_restless


@pytest.mark.rule(10)
def test_wake_ups_are_counted_against_the_time_that_has_passed() -> None:
    """A process that runs again and again at one instant ends the run; one that rests between them goes on."""
    core, agenda = (run := Played("a")).core, run.agenda
    run.play(core.begin())
    core.waits(run["a"], 0)
    wake_ups, limits = 1, []
    for command in core.run_on():  # without notes: there are too many
        if isinstance(command, RunProcess):
            wake_ups += 1
            rests = wake_ups >= STEPS - 1 and core.now_ns < S // 10
            core.waits(command.process, core.now_ns + (S // STEPS_HZ if rests else 0))
        elif isinstance(command, Limit):
            limits.append((core.now_ns, command.why))
    assert limits == [(S // 10, f"more than {STEPS + STEPS_HZ // 10:,} wake-ups")]
    assert agenda.end_ns == S // 10


@pytest.mark.rule(11)
def test_messages_are_announced_once_to_the_process_that_they_are_on_their_way_to() -> None:
    """With its next turn at the same instant, added up; not to an end that nobody is matched with."""
    run = Played("talks", "hears", "deaf")
    for name in ("hears", "deaf"):
        run.core.has(run[name], [claim("subscription", "/x")])
    run["deaf"].unmatched = frozenset({"topic /x"})
    run.core.has(run["talks"], [claim("publisher", "/x")])
    run.play(run.core.begin())
    run.core.sent(run["talks"], {"topic /x": 2})
    run.core.sent(run["talks"], {"topic /x": 1})
    run.done.clear()
    run.play(run.core.run_on())
    assert run.events() == ["0 hears 3 topic /x"]
    assert run["hears"].arrivals == {}


@pytest.mark.rule(12)
def test_what_is_sent_is_announced_to_whoever_it_reaches() -> None:
    """Topic, type and QoS have to fit; every client of a service gets all responses."""
    run = Played("a", "same", "other type", "wants more", "client", "client too", "server")
    run.core.has(run["a"], [claim("publisher", "/x", reliable=False), claim("service", "/s", CALLS.type)])
    run.core.has(run["same"], [claim("subscription", "/x", reliable=False)])
    run.core.has(run["other type"], [claim("subscription", "/x", INT, reliable=False)])
    run.core.has(run["wants more"], [claim("subscription", "/x", reliable=True)])
    for name in ("client", "client too"):
        run.core.has(run[name], [claim("client", "/s", CALLS.type)])
    run.core.has(run["server"], [claim("service", "/t", CALLS.type)])
    run.core.sent(run["a"], {"topic /x": 1, "response /s": 2})
    run.core.sent(run["client"], {"request /t": 1})
    assert {p.name: p.arrivals for p in run.processes if p.arrivals} == {
        "same": {"topic /x": 1},
        "client": {"response /s": 2},
        "client too": {"response /s": 2},
        "server": {"request /t": 1},
    }


@pytest.mark.rule(12)
def test_messages_of_one_report_are_recorded_in_one_order_once_all_have_arrived() -> None:
    """By topic, as the middleware decides whose come first; those of one topic keep their order."""
    sent = {"/b": 2, "/a": 2}
    arriving = Arriving(sent, {"/b": 1})
    b1, b2, a1, a2 = (Taken(f"/{name[0]}", FLOAT, b"", {"data": name}) for name in ("b1", "b2", "a1", "a2"))
    assert arriving.take([b1]) == []
    assert arriving.take([a1, b2]) == []
    assert arriving.missing == ["/a"]
    assert arriving.take([a2]) == []
    assert arriving.missing == []
    assert arriving.held() == [(a1, False), (a2, False), (b1, True), (b2, False)]
    assert arriving.held() == []


@pytest.mark.rule(12)
def test_time_does_not_go_on_before_what_was_announced_has_been_heard() -> None:
    """An answer comes back at the same instant."""
    run = Played("asks", "answers")
    run.core.has(run["asks"], [claim("publisher", "/q"), claim("subscription", "/a")])
    run.core.has(run["answers"], [claim("subscription", "/q"), claim("publisher", "/a")])
    run.play(run.core.begin())
    run.core.waits(run["asks"], 100 * MS)
    run.done.clear()
    said = iter([{"topic /q": 1}])
    run.does["asks"] = lambda one: run.core.sent(one.process, next(said, {}))
    run.does["answers"] = lambda one: run.core.sent(one.process, {"topic /a": 1})
    run.play(run.core.run_on())
    assert run.events() == [
        "100 asks",
        "100 answers 1 topic /q",
        "100 asks 1 topic /a",
    ]


@pytest.mark.rule(13)
def test_a_publisher_is_new_at_the_instant_at_which_it_was_first_reported() -> None:
    """A message that the host says was early is believed only then."""
    run = Played("a")
    old, new = claim("publisher", "/x", number=1), claim("publisher", "/x", number=2)
    run.core.has(run["a"], [old])
    assert run.core.is_new(run["a"], "/x")
    run.core.now_ns = 5
    run.core.has(run["a"], [old])
    assert not run.core.is_new(run["a"], "/x")
    run.core.has(run["a"], [old, new])
    assert run.core.is_new(run["a"], "/x")
    assert not run.core.is_new(run["a"], "/y")


@pytest.mark.rule(15)
def test_a_process_that_was_matched_runs_again_before_time_goes_on() -> None:
    """Also if the match comes with the last look for counterparts of an instant."""
    run = Played("a")
    run.wakes("a", 500)
    nudges = iter([True])
    run.during = lambda command: (
        setattr(run["a"], "nudged", next(nudges, False)) if isinstance(command, Retry) and not run.core.now_ns else None
    )
    run.play(run.core.begin())
    run.play(run.core.run_on())
    assert run.done[:4] == ["0 a", "0 retry", "0 a", "0 retry"]


@pytest.mark.rule(16)
def test_before_a_sender_leaves_all_others_wait_for_what_is_on_its_way_to_them() -> None:
    """They are told now, not with their next turn, and then have to run at this instant."""
    run = Played("leaves", "hears", "rests", "ended")
    run.play(run.core.begin())
    run["hears"].arrivals = {"topic /x": 2}
    run["ended"].arrivals, run["ended"].ended = {"topic /x": 2}, True
    run.done.clear()
    assert run.play(run.core.hand_over()) == ["0 hears receives {'topic /x': 2}"]
    assert (run["hears"].arrivals, run["hears"].nudged, run["rests"].nudged) == ({}, True, False)


# ------------------------------------------------------------------------- ends and steps


def test_a_run_ends_before_what_happens_at_its_end() -> None:
    """The window is half open; nothing is left to wait for when everybody has ended."""
    run = Played("a", due=[stop(1000)])
    run.wakes("a", 999, 1000)
    assert run.whole() == ["0 a", "999 a"]
    run = Played("a")
    run.does["a"] = lambda one: run.core.ended(one.process)
    assert run.whole() == ["0 a"]
    assert run.core.now_ns == 0
    run = Played("a", due=[stop(300)])
    run.does["a"] = lambda one: run.core.ended(one.process)
    assert run.whole() == ["0 a", "300 Disappear /x"]


def test_a_step_includes_its_end_and_tells_nobody_of_the_nanosecond_after_it() -> None:
    """The same core as of a plan, driven from outside: it ends where it was to go, or early."""
    run = Played("a", includes_end=True)
    run.wakes("a", 100, 200, 300)
    run.core.waits(run["a"], 0)
    run.core.go_to(100 * MS)
    run.play(run.core.run_on())
    run.core.arrive(early=False)
    assert run.events() == ["0 a", "100 a"]
    assert [one.free_until_ns for one in run.runs] == [100 * MS, 100 * MS]
    assert run.core.now_ns == 100 * MS
    run.core.go_to(1000 * MS)
    run.play(run.core.run_on(lambda: run.core.now_ns == 200 * MS))
    run.core.arrive(early=True)
    assert run.core.now_ns == 200 * MS
    run.core.go_to(50 * MS)
    run.core.arrive(early=False)
    assert run.core.now_ns == 200 * MS


def test_with_a_drawn_order_any_ready_process_may_be_the_first() -> None:
    """The draw decides among those that have something to do, each time anew."""
    run = Played("a", "b", "c", "rests", choose=lambda _, found: found[-1])
    run.play(run.core.begin())
    run.done.clear()
    for name in ("a", "b", "c"):
        run[name].nudged = True
    run.play(run.core.run_on())
    assert run.done[:3] == ["0 c", "0 b", "0 a"]


# ----------------------------------------------------------------------- time that work takes


@pytest.mark.rule(21)
def test_the_work_of_a_whole_run_does_not_outrun_its_time() -> None:
    """Also where no wake-up is late and no pause put off: one and a half times the time, and two seconds."""
    delay = Delay()
    for at in (0, 1, 2):
        delay.wake(at * S)
    delay.take(round(1.5 * S) + HOPELESS_NS)
    assert not delay.hides
    delay.take(1)
    assert delay.hides


@pytest.mark.rule(22)
def test_a_pause_is_certainly_counted_from_the_work_before_it_unless_the_program_has_looked() -> None:
    """A look at this instant may be for a deadline; one at an earlier instant, or of a library, is not."""
    clock = VirtualClock()
    clock.end_of(MS)
    assert (clock.paused, clock.counted) == (True, True)
    clock.counted = False
    clock.look(paces=False)
    clock.count_pause()
    assert clock.counted
    clock.counted = False
    clock.look()
    clock.count_pause()
    assert not clock.counted
    clock.move_to(EPOCH_NS + MS)
    clock.count_pause()
    assert clock.counted


class Worked:
    """Stands in for the measured work of a program."""

    def __init__(self, done_ns: int) -> None:
        self.done = done_ns
        self.free: list[int] = []

    def done_ns(self) -> int:
        return self.done

    def restart(self, free_ns: int) -> None:
        self.free.append(free_ns)
        self.done = 0


@pytest.mark.rule(23)
def test_where_it_is_charged_the_time_of_work_passes_at_the_next_look() -> None:
    """After each pause half a millisecond is free; too little is not worth a report."""
    host = Host()
    worked = Worked(3 * MS)
    host.time._work, host.time.clock.charge = worked, host.time._charge  # type: ignore[assignment]
    assert host.time.clock.look() == EPOCH_NS + 3 * MS
    assert host.reports[0].wake_ns == EPOCH_NS + 3 * MS
    assert host.reports[0].progress.charged
    worked.done = virtual.LEAST_NS - 1
    host.time.clock.look()
    assert len(host.reports) == 1
    worked.done, worked.free = 0, []
    host.answers = [answer(10, 50)]
    host.waits_until(10)
    host.waits_until(20)
    assert (len(host.reports), host.time.clock.now_ns) == (2, EPOCH_NS + 20 * MS)
    assert worked.free == [virtual.FREE_NS, virtual.FREE_NS] == [MS // 2, MS // 2]
