"""Runs the attacks of the table in an arena, and says of each what it achieved."""

from __future__ import annotations

import importlib.util
import shutil
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType

import hostile_reports
from arena import Arena, Ran
from attack_rubric import controller_rubric, publisher_rubric
from attack_verdicts import criteria_of, objections
from places import ROOT
from tables import read_table

from grader.grading.reporting.formats import FORMATS

HERE = Path(__file__).resolve().parent
REFERENCE = ROOT / "reference_solutions" / "velocity_publisher.py"
#: Right nodes among the attacking ones, first and last: what others do must not change what they get.
WITNESSES = ("a00_reference", "z99_reference")
NODE = "velocity_publisher"
CLASSROOM50 = {
    "CLASSROOM": "c",
    "ASSIGNMENT": "a",
    "ASSIGNMENT_TYPE": "individual",
    "OWNER": "o",
    "USERNAME": "u",
    "SUBMISSION_TAG": "submit/1",
    "COMMIT_URL": "https://example.org/1",
    "RELEASE_URL": "https://example.org/2",
    "REVIEW_URL": "https://example.org/3",
    "COMMIT_DATETIME": "2026-01-01T00:00:00+00:00",
}


@dataclass(frozen=True)
class Attack:
    """One line of the table; see the head of attacks.yaml."""

    number: int
    name: str
    fixture: str
    kind: str
    batch: str = ""
    earns: str = "honest"

    @property
    def path(self) -> Path:
        """Where the fixture is."""
        return HERE / self.fixture


def read_attacks() -> list[Attack]:
    """Return the table."""
    table = read_table(HERE / "attacks.yaml")
    return [Attack(**entry) for entry in table["attacks"]]


def units(attacks: Sequence[Attack]) -> dict[str, list[Attack]]:
    """Return the attacks by what is run together: a batch of nodes, or all of another kind."""
    found: dict[str, list[Attack]] = {}
    for attack in attacks:
        found.setdefault(attack.batch or attack.kind, []).append(attack)
    return found


def run_unit(tier: str, attacks: Sequence[Attack]) -> dict[int, list[str]]:
    """Run one unit in a tier and return what each attack achieved, by its number; nothing, if it was contained."""
    achieved: dict[int, list[str]] = {attack.number: [] for attack in attacks}
    with Arena(tier) as arena:
        for number, text in _RUNS[attacks[0].kind](arena, attacks):
            achieved[number].append(text)
    return achieved


Achieved = Iterator[tuple[int, str]]


def _run_nodes(arena: Arena, attacks: Sequence[Attack]) -> Achieved:
    """Run nodes in one submission, between two right ones."""
    folder = arena.folder("nodes")
    _equip(folder, arena)
    names = [attack.path.stem for attack in attacks]
    for attack in attacks:
        shutil.copy(attack.path, folder)
    if attacks[0].earns == "never_on":
        rubric = controller_rubric(names[0])
    else:
        for witness in WITNESSES:
            shutil.copy(REFERENCE, folder / f"{witness}.py")
        rubric = publisher_rubric([WITNESSES[0], *names, WITNESSES[1]])
    ran = _grade(arena, folder, rubric)
    numbers = [attack.number for attack in attacks]
    yield from _surroundings(arena, numbers, ran)
    for attack in attacks:
        yield from ((attack.number, text) for text in objections(ran.report, attack.path.stem, attack.earns))
    if ran.report and attacks[0].earns != "never_on":
        yield from ((number, text) for text in _witnesses(ran) for number in numbers)


def _witnesses(ran: Ran) -> Iterator[str]:
    for witness in WITNESSES:
        for what, criterion in criteria_of(ran.report, witness).items():
            if criterion["outcome"] != "met":
                yield f"a right node beside it: {what} is {criterion['outcome']}: {criterion['reason']}"


def _run_folders(arena: Arena, attacks: Sequence[Attack]) -> Achieved:
    """Grade folders one by one, each from inside it."""
    for attack in attacks:
        folder = arena.folder(attack.path.name)
        _equip(folder, arena)
        for path in sorted(attack.path.rglob("*_")):
            # The underscore at the end keeps fixtures from being what they look like, also in our own tools.
            target = folder / path.relative_to(attack.path).with_name(path.name[:-1])
            target.parent.mkdir(exist_ok=True)
            target.write_text(path.read_text("utf-8").replace("@OUTSIDE@", str(arena.outside)), encoding="utf-8")
        ran = _grade(arena, ".", publisher_rubric([NODE]), cwd=folder)
        yield from _surroundings(arena, [attack.number], ran)
        yield from ((attack.number, text) for text in objections(ran.report, NODE, attack.earns))


def _run_archives(arena: Arena, attacks: Sequence[Attack]) -> Achieved:
    """Hand in what a module builds; nothing of it is worth a point, and nothing of it may trouble the grader."""
    for attack in attacks:
        folder = arena.folder(attack.path.stem)
        for name, content in _module(attack.path).build(arena.outside).items():
            path = folder / name
            path.parent.mkdir(exist_ok=True)
            path.write_bytes(content)
            ran = _grade(arena, path.parent if "/" in name else path, publisher_rubric([NODE]))
            if ran.code not in (1, 2) or ran.report.get("score"):
                yield attack.number, f"{name}: exit code {ran.code}, score {ran.report.get('score')}: {ran.err[-300:]}"
            if _failed(ran) or not ran.report.get("final", True):
                yield attack.number, f"{name}: {ran.err[-300:]}"
            path.unlink()
            yield from (
                (number, f"{name}: {text}") for number, text in _surroundings(arena, [attack.number], ran, quiet=True)
            )


def _failed(ran: Ran) -> bool:
    """Whether the grader broke down; that is never a way to contain something."""
    return "the grader failed" in ran.err or "Traceback" in ran.err


def _run_replays(arena: Arena, attacks: Sequence[Attack]) -> Achieved:
    """Let one submission hear what it is asked, and a later one play that back."""
    listens, replays = attacks
    heard = []
    for attempt in ("first", "second"):
        folder = arena.folder(attempt)
        source = listens.path.read_text(encoding="utf-8")
        (folder / f"{listens.path.stem}.py").write_text(f"{source}# {attempt}\n", encoding="utf-8")
        ran = _grade(arena, folder, controller_rubric(listens.path.stem))
        yield from _surroundings(arena, [listens.number], ran)
        log = criteria_of(ran.report, listens.path.stem)["log"]
        heard.append(str(log["evidence"].get("first", "")))
    if not heard[0].startswith("heard") or heard[0] == heard[1]:
        yield listens.number, f"two tries were asked the same: {heard}"
    folder = arena.folder("replay")
    shutil.copy(replays.path, folder)
    values = [float(word) for word in heard[0].split()[1:]]
    (folder / "earlier.py").write_text(f"HEARD = {values}\n", encoding="utf-8")
    ran = _grade(arena, folder, controller_rubric(replays.path.stem))
    yield from _surroundings(arena, [replays.number], ran)
    yield from ((replays.number, text) for text in objections(ran.report, replays.path.stem, replays.earns))


def _run_empty(arena: Arena, attacks: Sequence[Attack]) -> Achieved:
    """Grade what cannot be judged, and judge by a rubric that asks nothing: neither is worth a point."""
    (attack,) = attacks
    folder = arena.folder("empty")
    for path in attack.path.glob("*_"):
        shutil.copy(path, folder / path.name[:-1])
    ran = _grade(arena, folder, publisher_rubric([NODE]))
    yield from _surroundings(arena, [attack.number], ran, quiet=True)
    if ran.code not in (1, 2) or ran.report.get("score") or _failed(ran):
        yield attack.number, f"nothing was judged, and it earned {ran.report.get('score')}"
    asks_nothing = publisher_rubric([NODE]).partition('"criteria"')[0] + '"criteria": []}'
    ran = _grade(arena, folder, asks_nothing)
    if ran.code != 2 or _failed(ran):
        yield attack.number, f"a rubric that asks nothing was not refused: exit code {ran.code}"


def _run_reports(arena: Arena, attacks: Sequence[Attack]) -> Achieved:
    """Have every format show hostile texts, also as the submission's name."""
    names = {69: '"><img src=x onerror=attack69()>', 70: "::error::attack70", 71: "=attack71()", 72: "attack72"}
    outputs = [format_ for format_ in FORMATS if format_ not in ("json", "text")]
    options = [word for f in outputs for word in ("-o", f"{f}={arena.base / 'out' / f'report.{f}'}")]
    for attack in attacks:
        folder = arena.folder(names[attack.number])
        shutil.copy(attack.path, folder / f"{NODE}.py")
        ran = _grade(arena, folder, publisher_rubric([NODE]), *options, more=CLASSROOM50)
        yield from _surroundings(arena, [attack.number], ran)
        yield from ((attack.number, text) for text in objections(ran.report, NODE, attack.earns))
        for format_ in ("json", "text", *outputs):
            content = ran.texts.get({"text": "report.txt"}.get(format_, f"report.{format_}"), b"")
            if not content:
                yield attack.number, f"{format_}: no report was written: {ran.err[-300:]}"
            yield from ((attack.number, f"{format_}: {text}") for text in hostile_reports.objections(format_, content))
        for where, printed in (("standard output", ran.out), ("standard error", ran.err)):
            found = hostile_reports.objections("text", printed.encode())
            yield from ((attack.number, f"{where}: {text}") for text in found)


def _surroundings(arena: Arena, numbers: Sequence[int], ran: Ran, *, quiet: bool = False) -> Achieved:
    """Yield what happened around a run; `quiet` if it need not have made a report."""
    if not ran.report and not quiet:
        yield from ((number, f"there is no report: exit code {ran.code}: {ran.err[-500:]}") for number in numbers)
    isolation = str(ran.report.get("environment", {}).get("isolation", arena.tier))
    if isolation.partition(" ")[0].rstrip(":") != arena.tier:
        yield from ((number, f"it ran in another tier: {isolation}") for number in numbers)
    for finding in arena.findings(ran):
        blamed = [finding.number] if finding.number in numbers else numbers
        yield from ((number, finding.text) for number in blamed if number is not None)


def _grade(
    arena: Arena,
    submission: Path | str,
    rubric: str,
    *options: str,
    cwd: Path | None = None,
    more: dict[str, str] | None = None,
) -> Ran:
    path = arena.base / "rubric.yaml"
    path.write_text(rubric, encoding="utf-8")
    return arena.grade(submission, "--rubric", str(path), *options, cwd=cwd, more=more)


def _equip(folder: Path, arena: Arena) -> None:
    for path in (HERE / "kit").glob("*.py"):
        shutil.copy(path, folder)
    (folder / "planted.py").write_text(arena.planted(), encoding="utf-8")


def _module(path: Path) -> ModuleType:
    spec = importlib.util.spec_from_file_location(path.stem, path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


_RUNS: dict[str, Callable[[Arena, Sequence[Attack]], Achieved]] = {
    "node": _run_nodes,
    "folder": _run_folders,
    "archive": _run_archives,
    "replay": _run_replays,
    "empty": _run_empty,
    "report": _run_reports,
}
