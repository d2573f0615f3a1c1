"""Spot checks: who is checked, what a disagreement leads to, and programs that are right only in virtual time."""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import Any

import pytest
from decided import grade_until_decided, say_nothing

from grader.grading.app.grade import Progress
from grader.grading.app.request import GradeRequest
from grader.grading.app.spot_checks import SpotChecks, check, is_spot_checked, shortened
from grader.grading.app.start import grade_once
from grader.grading.judging.beginnings import BeginningJudge
from grader.grading.judging.checks.fields import FieldEqual
from grader.grading.judging.checks.rate import TopicRate
from grader.grading.model.exercise import Criterion, Exercise
from grader.grading.model.report import Report
from grader.grading.model.run import Run
from grader.runtime.host.clock import EPOCH_NS, EPOCH_SPAN_S, UPTIME_NS, UPTIME_SPAN_S
from grader.runtime.model.scenario import Scenario, Span
from grader.runtime.model.submission import StudentFile, Submission
from grader.runtime.model.trace import AssessedTrace, ClockKind, Mark
from grader.runtime.plan import Plan
from grader.runtime.supervisor.supervisor import Job
from grader.testing import TraceBuilder

HERE = Path(__file__).parent / "spot_checks"
#: The cheats that are not left to the nightly run: one that no file shows, and one that any file shows.
USUAL = ("patches_the_host", "two_clocks")
FLOAT = "std_msgs/msg/Float32"
S = 1_000_000_000


def job(scenario: str = "alone", **fields: Any) -> Job:
    return Job(scenario, Plan(scenario, (("a.py", "a.py"),), "/", "00", 10 * S, "/x", 60 * S, "virtual", **fields))


def trace(
    clock: ClockKind = ClockKind.VIRTUAL, *, rate_hz: float = 20.0, value: float = 1.0, **fields: Any
) -> AssessedTrace:
    made = TraceBuilder("a.py", clock=clock).messages("/x", FLOAT, {"data": value}, rate_hz=rate_hz).trace()
    return replace(made, scenario="alone", **fields)


#: The value of every message that is right.
RIGHT = 1.0
CRITERION = Criterion("value", "Publishes 1", Fraction(4), "alone", FieldEqual("/x", {"data": RIGHT}))


def judge_of(key: tuple[str, str]) -> BeginningJudge:
    """Return what judges a scenario of one program whose messages hold a constant."""
    scenario = Scenario(key[1], ("a.py",), Span(10 * S))
    criteria = (replace(CRITERION, scenario=key[1]),)
    exercise = Exercise(key[0], "1", "One", True, ("a.py",), (scenario,), criteria, "sha256:0")
    submission = Submission("s", "s", Path("s"), "sha256:0", {"a.py": StudentFile("a.py", "a.py")})
    return BeginningJudge(exercise, key[1], submission, {})


class Recorder:
    """Gives traces of the wall clock in order, and remembers the plans, and which jobs were recorded in parallel."""

    def __init__(self, *traces: AssessedTrace) -> None:
        self.traces = list(traces)
        self.plans: list[Plan] = []
        self.parallel: list[str] = []

    def __call__(self, jobs: Sequence[Job]) -> Sequence[AssessedTrace]:
        self.plans += [job.plan for job in jobs]
        self.parallel += [job.title for job in jobs if job.parallel]
        return [self.traces.pop(0) for _ in jobs]


def checked(
    recorder: Recorder,
    *,
    reaches: tuple[str, ...] = ("gc",),
    share: float = 0.0,
    virtual: AssessedTrace | None = None,
    **fields: Any,
) -> AssessedTrace:
    heard = []
    checks = SpotChecks(share, 1, "sha256:0", reaches)
    jobs = {("one", "alone"): job(**fields)}
    traces = {("one", "alone"): virtual or trace()}
    found = check(checks, jobs, traces, recorder, lambda key, t: heard.append((key, t)), judge_of)
    assert heard == [(key, found[key]) for key in found] or not recorder.plans
    return found["one", "alone"]


SAME, OTHER = trace(ClockKind.WALL), trace(ClockKind.WALL, rate_hz=1.0)
ON_THE_WALL = replace(SAME, clock_reason="the node needs so much processor time")
BUSY = replace(OTHER, harness_problem="the machine was too busy")


def test_who_is_neither_drawn_nor_suspected_is_not_checked() -> None:
    """Nothing is recorded twice."""
    recorder = Recorder()
    assert checked(recorder, reaches=()).clock is ClockKind.VIRTUAL
    assert recorder.plans == []


@pytest.mark.parametrize("share", [0.5, 0.9])
def test_silence_of_programs_that_had_no_time_is_no_disagreement(share: float) -> None:
    """Half of the time would have been enough to publish something; a tenth of it is not."""
    nothing = replace(TraceBuilder("a.py", clock=ClockKind.WALL).trace(), scenario="alone")
    silent = replace(nothing, most_starved_ns=round(share * nothing.stop_ns))
    enough = share == 0.5
    speaks = TraceBuilder("a.py").messages("/x", FLOAT, {"data": RIGHT}, rate_hz=2.0, start_s=3.0).trace()
    found = checked(Recorder(*[silent] * 3), reaches=(), share=1.0, virtual=replace(speaks, scenario="alone"))
    assert (found.clock is ClockKind.WALL, bool(found.unchecked)) == (enough, not enough)


def test_where_the_clocks_agree_virtual_time_counts() -> None:
    """One short recording, with nothing of the grader in the process."""
    recorder = Recorder(SAME)
    assert checked(recorder) == trace()
    (plan,) = recorder.plans
    assert (plan.clock, plan.bare, plan.duration_ns) == ("wall", True, 4 * S)


def test_where_they_disagree_the_wall_clock_decides() -> None:
    """Seen twice, then everything is recorded in full, and the reason says how they differ."""
    recorder = Recorder(OTHER, OTHER, OTHER)
    decided = checked(recorder)
    assert decided.clock is ClockKind.WALL
    assert decided.clock_reason.endswith("/x had 20.0 Hz in virtual time and 1.0 Hz on the wall clock")
    assert [plan.duration_ns for plan in recorder.plans] == [4 * S, 4 * S, 10 * S]


def test_a_criterion_that_is_met_on_one_clock_only_lets_the_wall_clock_decide() -> None:
    """Also where the values are close: the check compares, with its own tolerance."""
    off = trace(ClockKind.WALL, value=1.001)
    decided = checked(Recorder(off, off, off))
    assert decided.clock_reason.endswith('"Publishes 1" was met in virtual time and not met on the wall clock')
    assert decided.messages("/x") == off.messages("/x")
    assert checked(Recorder(off, SAME)) == trace()


def starved(found: AssessedTrace) -> AssessedTrace:
    return replace(found, most_starved_ns=S)


def test_a_criterion_that_a_busy_machine_left_open_is_asked_again() -> None:
    """A node that had to wait for a processor may be wrong for that, and never counts; its rate is not compared."""
    with_rate = replace(CRITERION, check=TopicRate("/x", 20.0, 1.0))
    slow = starved(trace(ClockKind.WALL, rate_hz=18.5))

    def judges_rate(key: tuple[str, str]) -> BeginningJudge:
        judge = judge_of(key)
        exercise = replace(judge._exercise, criteria=(with_rate,))
        return BeginningJudge(exercise, key[1], judge._submission, {})

    def found(*walls: AssessedTrace) -> AssessedTrace:
        checks, key, recorder = SpotChecks(0.0, 1, "sha256:0", ("gc",)), ("one", "alone"), Recorder(*walls)
        return check(checks, {key: job()}, {key: trace()}, recorder, lambda *_: None, judges_rate)[key]

    assert found(slow, slow, slow).harness_problem.startswith("the machine was too busy")
    assert found(slow, SAME) == trace()
    assert found(*[trace(ClockKind.WALL, rate_hz=18.5)] * 3).clock is ClockKind.WALL


def several(**programs: str) -> dict[tuple[str, str], Job]:
    """Return the jobs of an exercise whose scenarios run so many programs, named by letters."""
    made = {("one", name): job(name) for name in programs}
    return {
        key: replace(one, plan=replace(one.plan, processes=tuple((p, p) for p in programs[key[1]])))
        for key, one in made.items()
    }


def drawn_scenarios(jobs: dict[tuple[str, str], Job], number: int, reaches: tuple[str, ...] = ()) -> set[str]:
    checks = SpotChecks(1.0, 1, f"sha256:{number}", reaches)
    return {scenario for _, scenario in checks.due(jobs, dict.fromkeys(jobs, trace()))}


def test_each_program_is_checked_in_one_scenario() -> None:
    """By itself if it can be; which one, only the key tells, and now and then those of several programs too."""
    jobs = several(first="a", second="a", third="b", both="ab")
    drawn = [drawn_scenarios(jobs, number) for number in range(400)]
    assert all("third" in found and len(found & {"first", "second"}) == 1 for found in drawn)
    assert 150 < sum("first" in found for found in drawn) < 250
    assert 60 < sum("both" in found for found in drawn) < 140
    assert drawn_scenarios(jobs, 0, ("gc",)) == {"first", "second", "third", "both"}


def test_a_program_that_never_runs_alone_is_checked_beside_others() -> None:
    """And an exercise with one scenario is checked in that one."""
    assert drawn_scenarios(several(both="ab"), 3) == {"both"}
    assert drawn_scenarios(several(all="abc", two="ab"), 3) >= {"all", "two"}


def test_only_what_disagrees_beside_others_is_recorded_alone() -> None:
    """Others can make the clocks disagree, never agree; so what disagrees beside them does not count."""
    keys = ("one", "alone"), ("two", "alone"), ("two", "beside")
    jobs = {key: job(f"{key[0]} {key[1]}") for key in keys}
    recorder = Recorder(SAME, BUSY, OTHER, SAME, OTHER, OTHER, OTHER, OTHER)
    checks = SpotChecks(0.0, 1, "sha256:0", ("gc",))
    found = check(checks, jobs, dict.fromkeys(keys, trace()), recorder, lambda *_: None, judge_of)
    assert recorder.parallel == [f"{one} {two}, checked on the wall clock" for one, two in keys]
    assert [plan.scenario for plan in recorder.plans[3:6]] == ["two alone", "two beside", "two beside"]
    assert [found[key].clock for key in keys] == [ClockKind.VIRTUAL, ClockKind.WALL, ClockKind.WALL]


def test_a_disagreement_that_does_not_come_again_is_none() -> None:
    """It was the machine."""
    assert checked(Recorder(OTHER, SAME)) == trace()


def test_a_busy_machine_is_nobodys_mark() -> None:
    """Of a drawn submission virtual time counts, and is not final; of one that a check is about nothing is decided."""
    drawn = checked(Recorder(BUSY, BUSY, BUSY), reaches=(), share=1.0)
    assert drawn.harness_problem == ""
    assert drawn.unchecked == "the machine was too busy for a check on the wall clock"
    assert checked(Recorder(BUSY, BUSY, BUSY)).harness_problem.startswith("the machine was too busy")


def on_wall(
    *, topic: str = "/x", value: float = RIGHT, rate_hz: float = 20.0, kind: str = "std_msgs/msg/Float32"
) -> AssessedTrace:
    """Return a recording of a machine that was too busy."""
    made = TraceBuilder("a.py", clock=ClockKind.WALL).publisher(topic, kind)
    found = made.messages(topic, kind, {"data": value}, rate_hz=rate_hz).trace()
    return replace(found, scenario="alone", harness_problem=BUSY.harness_problem, most_starved_ns=9 * S)


@pytest.mark.parametrize(
    "wall",
    [on_wall(topic="/t1"), on_wall(value=2.0), on_wall(kind="std_msgs/msg/Float64")],
    ids=["a topic", "a value", "a type"],
)
def test_what_no_busy_machine_can_cause_decides_however_busy_it_was(wall: AssessedTrace) -> None:
    """What exists on the wall clock alone was made by the program: nothing excuses it."""
    same = TraceBuilder("a.py").publisher("/x", FLOAT).messages("/x", FLOAT, {"data": RIGHT}, rate_hz=20.0)
    decided = checked(
        Recorder(wall, wall, wall), virtual=replace(same.trace(), scenario="alone"), reaches=(), share=1.0
    )
    assert decided.clock is ClockKind.WALL


def test_a_recording_that_is_cut_off_on_the_wall_clock_agrees_with_nothing() -> None:
    """Whoever fills it at once would leave nothing to compare."""
    cut = replace(trace(ClockKind.WALL), stop_ns=S // 2, observations=(Mark(S // 2, "limit", "more than 1 MiB"),))
    decided = checked(Recorder(cut, cut, cut), reaches=(), share=1.0)
    assert decided.clock is ClockKind.WALL
    assert decided.clock_reason.endswith(
        "the recording was complete in virtual time and cut off (more than 1 MiB) on the wall clock"
    )


def test_slowness_that_a_busy_machine_explains_is_no_difference() -> None:
    """A node that waited for a processor for half of the time is half as fast, whatever the loop has noticed."""
    slow = replace(trace(ClockKind.WALL, rate_hz=11.0), most_starved_ns=5 * S)
    found = checked(Recorder(slow, slow, slow), reaches=(), share=1.0)
    assert (found.clock, bool(found.unchecked)) == (ClockKind.VIRTUAL, True)
    hardly = replace(slow, most_starved_ns=S)
    assert checked(Recorder(hardly, hardly, hardly), reaches=(), share=1.0).clock is ClockKind.WALL


def test_a_machine_that_is_too_busy_to_decide_takes_no_points() -> None:
    """A difference that load can cause leaves virtual time, and is not final; what a check is about is undecided."""
    open_ = checked(Recorder(OTHER, OTHER, BUSY), reaches=(), share=1.0)
    assert (open_.clock, bool(open_.unchecked), open_.harness_problem) == (ClockKind.VIRTUAL, True, "")
    assert checked(Recorder(OTHER, OTHER, BUSY)).harness_problem == BUSY.harness_problem


def test_a_busy_machine_is_given_another_try() -> None:
    """A check that was held up counts neither way, unless the clocks agree all the same."""
    assert checked(Recorder(BUSY, BUSY, SAME)) == trace()
    assert checked(Recorder(BUSY, OTHER, BUSY, OTHER, OTHER)).clock is ClockKind.WALL
    assert checked(Recorder(replace(SAME, harness_problem="the machine was too busy"))) == trace()


def test_what_a_process_reached_for_is_enough() -> None:
    """The names in its files may hide it."""
    recorder = Recorder(OTHER, OTHER, OTHER)
    assert checked(recorder, reaches=(), virtual=trace(reached=("gc.get_objects",))).clock is ClockKind.WALL


@pytest.mark.parametrize("found", [trace(clock_reason="busy"), trace(harness_problem="lost"), ON_THE_WALL])
def test_what_virtual_time_does_not_decide_is_not_checked(found: AssessedTrace) -> None:
    """The wall clock has it already, or nobody."""
    recorder = Recorder()
    assert checked(recorder, virtual=found, reaches=(), share=1.0) == found
    assert recorder.plans == []


def test_who_is_suspected_is_checked_on_the_wall_clock_as_well() -> None:
    """There, too, the grader was in its process; what it does without it counts."""
    assert checked(Recorder(SAME), virtual=ON_THE_WALL) == ON_THE_WALL
    decided = checked(Recorder(OTHER, OTHER, OTHER), virtual=ON_THE_WALL)
    assert decided.clock_reason.endswith("/x had 20.0 Hz beside the grader's own code and 1.0 Hz without it")
    assert len(decided.messages("/x")) == len(OTHER.messages("/x"))


def test_a_slow_start_is_waited_for() -> None:
    """As long as in virtual time, and some more."""
    late = TraceBuilder("a.py").messages("/x", FLOAT, {"data": 1.0}, start_s=8.0, rate_hz=20.0).trace()
    assert shortened(job().plan, late, judge_of(("one", "alone"))).wait_at_most_ns == 18 * S


def test_the_draw_repeats_and_has_the_share_asked_for() -> None:
    """It follows from the seed, which only the key tells, and the digest."""
    digests = [f"sha256:{n}" for n in range(2000)]
    drawn = [d for d in digests if is_spot_checked(0.05, 7, d)]
    assert drawn == [d for d in digests if is_spot_checked(0.05, 7, d)]
    assert 60 < len(drawn) < 140
    assert drawn != [d for d in digests if is_spot_checked(0.05, 8, d)]
    assert not any(is_spot_checked(0.0, 7, d) for d in digests)
    assert all(is_spot_checked(1.0, 7, d) for d in digests)


# --- for real ---


def graded(tmp_path: Path, file: Path, hear: Progress = say_nothing, **options: Any) -> Report:
    """Grade a file as a velocity publisher that is watched for three seconds."""
    folder = tmp_path / "submission"
    folder.mkdir(exist_ok=True)
    shutil.copy(file, folder / "velocity_publisher.py")
    rubric = tmp_path / "rubric.yaml"
    text = (HERE.parents[3] / "rubrics" / "exercise_1" / "rubric.yaml").read_text(encoding="utf-8")
    rubric.write_text(text.replace("10 s", "3 s").replace("60 s", "3 s"), encoding="utf-8")
    return grade_until_decided(GradeRequest(str(folder), rubrics=(rubric,), **options), hear)


@pytest.mark.breadth(0, 1)
@pytest.mark.ros
@pytest.mark.parametrize(
    "file",
    [
        pytest.param(file, id=file.stem, marks=pytest.mark.long if file.stem in USUAL else pytest.mark.nightly)
        for file in sorted((HERE / "cheats").glob("*.py"))
    ],
)
def test_a_program_that_is_right_only_in_virtual_time_loses(tmp_path: Path, file: Path) -> None:
    """Whatever it tells the clocks apart by; what no file shows is found where it is drawn."""
    assert graded(tmp_path, file, clock="virtual").score == 30
    report = graded(tmp_path, file, spot_checks=1.0 if file.stem.startswith("drawn_") else 0.0)
    (exercise,) = report.exercises
    assert report.score <= 20
    assert report.final
    assert exercise.clock is ClockKind.WALL
    assert exercise.clock_reason.startswith("the node behaved differently ")


@pytest.mark.breadth(1, 1)
@pytest.mark.ros
@pytest.mark.long
@pytest.mark.parametrize("file", sorted((HERE / "honest").glob("*.py")), ids=lambda file: file.stem)
def test_an_honest_program_keeps_its_marks(tmp_path: Path, file: Path) -> None:
    """It looks suspicious, and is the same on both clocks."""
    assert graded(tmp_path, file).score == 30


@pytest.mark.ros
@pytest.mark.nightly
@pytest.mark.parametrize("folder", sorted((HERE / "checked").iterdir()), ids=lambda folder: folder.name)
def test_what_only_a_rubrics_check_tells_apart_is_found(folder: Path) -> None:
    """Texts, logged numbers and values that vary: each keeps its points in virtual time."""
    (file,) = folder.iterdir()
    asked = {"battery_service_server.py": "project_3", "simple_publisher.py": "project_1"}
    asked |= {"odom_subscriber.py": "exercise_2"}
    rubrics = (HERE.parents[3] / "rubrics" / asked[file.name] / "rubric.yaml",)
    report = grade_until_decided(GradeRequest(str(folder), rubrics=rubrics, spot_checks=1.0))
    (exercise,) = report.exercises
    assert exercise.clock is ClockKind.WALL
    assert exercise.clock_reason.endswith(" was met in virtual time and not met on the wall clock")
    before = grade_until_decided(GradeRequest(str(folder), rubrics=rubrics, clock="virtual"))
    assert report.score < before.score


@pytest.mark.ros
def test_defining_classes_is_no_reason_for_a_check(tmp_path: Path) -> None:
    """Named tuples, data classes and enumerations run code that Python writes itself."""
    steps: list[str] = []

    def hear(step: str) -> None:
        steps.append(step)

    report = graded(tmp_path, HERE / "makes_classes.py", hear)
    assert (report.score, [step for step in steps if "wall clock" in step]) == (30, [])


def told_of(tmp_path: Path, seed: int) -> tuple[int, int, str]:
    """Return the date, the uptime and the order of a set that a program sees in virtual time, as it logs them."""
    folder = tmp_path / str(seed)
    folder.mkdir(exist_ok=True)
    shutil.copy(HERE / "tells_the_time.py", folder / "velocity_publisher.py")
    runs: list[Run] = []
    request = GradeRequest(str(folder), exercises=("velocity_publisher",), clock="virtual", seed=seed)
    grade_once(request, say_nothing, lambda run, _: runs.append(run), pictures=False)
    (found,) = runs[0].traces.values()
    date, uptime, order = found.records()[0].text.split()
    return int(date), int(uptime), order


@pytest.mark.nightly
@pytest.mark.ros
def test_the_date_and_the_hashes_follow_from_the_seed(tmp_path: Path) -> None:
    """So no program knows them, and the same file gets the same report on every day."""
    first, again, other = (told_of(tmp_path, seed) for seed in (1, 1, 2))
    assert first == again
    assert all(one != another for one, another in zip(first, other, strict=True))
    for date, uptime, order in (first, other):
        assert 0 <= date - EPOCH_NS // S <= EPOCH_SPAN_S
        assert 0 <= uptime - UPTIME_NS // S <= UPTIME_SPAN_S
        assert sorted(order) == list("abcdefghijklmnop")


@pytest.mark.ros
def test_the_order_of_a_set_in_a_fork_helps_nobody(tmp_path: Path) -> None:
    """A program that uses it runs with hashes of its own, also in virtual time."""
    assert graded(tmp_path, HERE / "order_of_a_set.py", clock="virtual").score <= 20


@pytest.mark.long
@pytest.mark.ros
def test_a_module_that_nobody_read_is_a_reason_for_a_check(tmp_path: Path) -> None:
    """One that the program writes; one of its own files is not."""
    steps: list[str] = []
    assert graded(tmp_path, HERE / "honest" / "writes_a_module.py", steps.append).score == 30
    assert any("checked on the wall clock" in step for step in steps)
    (tmp_path / "submission" / "helper.py").write_text("SPEED = 0.5\n", encoding="utf-8")
    text = (HERE / "makes_classes.py").read_text(encoding="utf-8")
    (tmp_path / "uses_helper.py").write_text(text.replace("import rclpy\n", "import helper\nimport rclpy\n", 1))
    steps.clear()
    assert graded(tmp_path, tmp_path / "uses_helper.py", steps.append).score == 30
    assert [step for step in steps if "wall clock" in step] == []


@pytest.mark.ros
@pytest.mark.long
def test_a_checked_process_holds_nothing_of_the_grader(tmp_path: Path) -> None:
    """Neither a module, a path, a variable, an argument nor a descriptor; nothing is replaced, and chance is real."""
    (exercise,) = graded(tmp_path, HERE / "looks_around.py").exercises
    assert exercise.clock is ClockKind.WALL
    told = next(v for v in exercise.verdicts if v.id == "logging").evidence
    assert "found: nothing" in str(told), told
