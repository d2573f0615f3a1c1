"""Makes the parts of the documentation that the code already says: commands, rubrics' grammar, checks, and exercises.

Usage: python docs/generated.py     renews them in the pages

Such a part stands in its page, so that it can be read in the repository too, between the comments
`<!-- generated: NAME -->` and `<!-- end of generated: NAME -->`; NAMES lists the names. What is too large for the
repository, reports and charts, is made when the site is built: `<!-- site: TEXT -->` is text of the site alone.
"""

from __future__ import annotations

import ast
import inspect
import io
import re
import sys
from collections.abc import Callable, Iterator, Mapping
from enum import Enum
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any

import click
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure as MatplotlibFigure
from ruamel.yaml import YAML

from grader import api
from grader.api import unstable as unstable_api
from grader.cli.main import app
from grader.grading.app.explain import explain_checks, explain_rubrics
from grader.grading.judging.run_check import check_name
from grader.grading.model.chart import Chart, Panel
from grader.grading.model.exercise import Criterion, Exercise
from grader.grading.model.report import CheckExplanation, CheckParameter, CriterionExplanation, Report
from grader.grading.reporting.html.render import render_html
from grader.grading.rubrics.exercise_checks import known_checks
from grader.grading.rubrics.loader import read_rubric
from grader.grading.rubrics.schema import rubric_schema
from grader.runtime.model import quantities

ROOT = Path(__file__).resolve().parent.parent
sys.path.append(str(ROOT / "tests" / "support"))
import archive  # noqa: E402  the recordings of the test submissions
import sample_folders  # noqa: E402  where those are

#: A recording of each exercise that shows what a report and its charts look like.
EXAMPLES = {
    "velocity_publisher": "wrong/velocity_18_5_hz",
    "odom_subscriber": "wrong/odom_swapped_xy",
    "two_node_communication": "wrong/fan_on_at_25",
    "joint_publisher": "wrong/joint_amplitude",
    "joint_subscriber": "wrong/angle_pi_is_3",
    "battery_service": "wrong/battery_client_limit_30",
}


# --- the command line -------------------------------------------------------------------------------------------------


def commands() -> str:
    """Return a section for each command: usage, description and options."""
    return "\n".join(_sections("grade", app.default)) + "\n".join(_subcommands("grade", app))


def _subcommands(path: str, group: click.Group) -> Iterator[str]:
    context = click.Context(group)
    for name in group.list_commands(context):
        command = group.get_command(context, name)
        if command is None or command.hidden:
            continue
        if isinstance(command, click.Group):
            yield f"\n## `{path} {name}`\n\n{_described(command)}\n"
            yield from _subcommands(f"{path} {name}", command)
        else:
            yield from _sections(f"{path} {name}", command)


def _sections(path: str, command: click.Command) -> Iterator[str]:
    # A command keeps the help option that it has in its first context
    context = click.Context(command, info_name=path, **app.context_settings)
    level = "##" if path.count(" ") < 2 else "###"
    usage = " ".join([path, *command.collect_usage_pieces(context)])
    yield f"\n{level} `{path}`\n\n    {usage}\n\n{_described(command)}\n"
    yield "| option | meaning |\n|---|---|"
    for parameter in command.params:
        record = parameter.get_help_record(context)
        if record is not None:
            yield f"| {', '.join(f'`{name}`' for name in record[0].split(', '))} | {_cell(record[1])} |"
    yield "| `-h`, `--help` | Show this message and exit. |"


def _described(command: click.Command) -> str:
    return "\n\n".join(filter(None, [inspect.cleandoc(command.help or ""), command.epilog or ""]))


def _cell(text: str) -> str:
    """Return text for a cell of a table, in one line."""
    parts = re.split(r"(`[^`]*`)", " ".join(text.split()))
    return "".join(part if part.startswith("`") else part.replace("|", "\\|").replace("<", "&lt;") for part in parts)


# --- the grammar of rubrics -------------------------------------------------------------------------------------------

_VARIANT = "VariantReference"
#: The pattern of texts that may be anything but blank.
_ANY_TEXT = r"^(?:[\s\S]*\S[\s\S]*)$"


def grammar() -> str:
    """Return a table of keys for each mapping of a rubric, except those that are the parameters of a check."""
    schema = rubric_schema()
    parts = schema["$defs"]
    checks = {reference["$ref"].rpartition("/")[2] for reference in parts["Check"]["properties"].values()}
    todo, done = _referred(schema["properties"]), [_table("A rubric", schema)]
    seen: list[str] = []
    while todo:
        name = todo.pop(0)
        if name in seen or name in checks or name in ("Check", _VARIANT):
            continue
        seen.append(name)
        done.append(_table(_title(name), parts[name]))
        todo += _referred(parts[name])
    # What only checks refer to, such as the cases of a reaction, is a part of their grammar.
    rest = {inner for check in checks for inner in _nested(check, parts)} - {*seen, *checks, _VARIANT}
    done += [_table(_title(name), parts[name]) for name in sorted(rest)]
    return "\n\n".join(done)


def _nested(name: str, parts: Mapping[str, Any]) -> set[str]:
    found = set(_referred(parts[name]))
    return found | {inner for part in found if part != _VARIANT for inner in _nested(part, parts)}


def _referred(node: object) -> list[str]:
    """Return the names of the definitions that a part of the schema refers to, in order."""
    if isinstance(node, dict):
        own = [node["$ref"].rpartition("/")[2]] if "$ref" in node else []
        return list(dict.fromkeys([*own, *(name for value in node.values() for name in _referred(value))]))
    return list(dict.fromkeys(name for item in node for name in _referred(item))) if isinstance(node, list) else []


def _title(name: str) -> str:
    words = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", name.removesuffix("Shape")).lower()
    return words[0].upper() + words[1:]


def _link(name: str) -> str:
    if name == "Check":
        return "[a check](checks.md)"
    return f"[{_title(name).lower()}](#{_title(name).lower().replace(' ', '-')})"


def _table(title: str, node: Mapping[str, Any]) -> str:
    required = node.get("required", [])
    about = node.get("description", "").removeprefix("A stimulus: ")
    about = about[:1].upper() + about[1:]
    rows = [
        f"| `{key}` | {'yes' if key in required else ''} | {_kind(value)} | {_remark(value)} |"
        for key, value in node.get("properties", {}).items()
    ]
    head = f"### {title}\n\n{about}\n"
    if not rows:
        return f"{head}\nWritten as {_kind({key: value for key, value in node.items() if key != 'description'})}."
    one = "Exactly one of these keys:\n\n" if node.get("maxProperties") == 1 else ""
    return "\n".join([f"{head}\n{one}| key | required | value | |", "|---|---|---|---|", *rows])


def _remark(node: Mapping[str, Any]) -> str:
    least = f"at least {node['minimum']}" if "minimum" in node else ""
    default = node.get("default")
    usual = f"`{str(default).lower()}` by default" if default not in (None, [], {}) else ""
    return _cell("; ".join(filter(None, [_about(node), least, usual])))


def _about(node: Mapping[str, Any]) -> str:
    """Return what a key is for, which stands with its value where a variant may stand instead."""
    options = [node, *(option for option in node.get("anyOf", []) if "$ref" not in option)]
    return next((option["description"] for option in options if "description" in option), "")


def _kind(node: Mapping[str, Any]) -> str:
    """Return what may be written for a value. Null and a variant are left out: the page says where they may stand."""
    options = node.get("anyOf", node.get("oneOf"))
    if options:
        kept = [o for o in options if o.get("type") != "null" and not o.get("$ref", "").endswith(_VARIANT)]
        return " or ".join(dict.fromkeys(map(_kind, kept)))
    if "$ref" in node:
        return _link(node["$ref"].rpartition("/")[2])
    words = node.get("enum", [node["const"]] if "const" in node else [])
    return " or ".join(f"`{word}`" for word in words) or _type(node)


def _type(node: Mapping[str, Any]) -> str:
    """Return the JSON type of a value, and an example or what is inside."""
    kind = node.get("type", "anything")
    if kind == "array":
        return f"list of {_kind(node['items'])}" if "items" in node else "list"
    if kind == "object":
        inner = node.get("additionalProperties") or next(iter(node.get("patternProperties", {}).values()), None)
        keys = node.get("propertyNames", {}).get("examples", ["name"])
        return f"mapping of keys such as `{keys[0]}` to {_kind(inner)}" if inner else "mapping"
    if kind == "string" and node.get("pattern") != _ANY_TEXT and "examples" in node:
        return f"text such as `{node['examples'][0]}`"
    kinds = kind if isinstance(kind, list) else [kind]
    return " or ".join("text" if one == "string" else one for one in kinds)


# --- checks -----------------------------------------------------------------------------------------------------------


def checks() -> str:
    """Return a list of all checks, then for each its manual, its parameters, its uses, and a chart if it has one."""
    found = [e for e in explain_checks() if isinstance(e, CheckExplanation)]
    pictures = charts()
    rows = [f"| [`{e.name}`](#{e.name}) | {_cell(e.asks)} |" for e in found]
    return (
        "\n".join(["| check | asks |", "|---|---|", *rows]) + "\n\n" + "\n\n".join(_check(e, pictures) for e in found)
    )


def _check(e: CheckExplanation, pictures: Mapping[str, Chart]) -> str:
    lines = [f"## {e.name}", e.asks, e.details]
    if e.parameters:
        lines.append("\n".join(["| parameter | default | meaning |", "|---|---|---|", *map(_parameter, e.parameters)]))
    if e.used_by:
        lines.append(f"Used by {', '.join(map(_gallery_link, e.used_by))}.")
    if e.name in pictures:
        chart = pictures[e.name]
        lines.append(_on_site(f"![{_cell(f'{chart.title}. {chart.about}')}](charts/{e.name}.svg)"))
    return "\n\n".join(filter(None, lines))


def _parameter(parameter: CheckParameter) -> str:
    default = "required" if parameter.required else f"`{parameter.value}`"
    return f"| `{parameter.name}` | {default} | {_cell(parameter.meaning)} |"


def _gallery_link(used: str) -> str:
    exercise, _, criterion = used.partition("/")
    return f"[`{criterion}`](../gallery.md#{exercise}) of {exercise}"


@cache
def charts() -> dict[str, Chart]:
    """Return a chart for each check that has one, of the reports in EXAMPLES."""
    found: dict[str, Chart] = {}
    for name, exercise in exercises().items():
        of = {criterion.id: check_name(criterion) for criterion in exercise.criteria}
        for report in example_report(name).exercises:
            for figure in report.figures:
                if isinstance(figure, Chart):
                    found |= {of[id_]: figure for id_ in figure.criteria if of[id_] not in found}
    return found


_COLOURS = {"main": "#2f6fde", "second": "#c2571a", "third": "#6d4bb5", "faint": "#8a8f98"}
_COLOURS |= {"good": "#1f8a4c", "warning": "#b77400", "bad": "#cc2f2f"}
#: Readable on a light page and on a dark one.
_STYLE: dict[Any, Any] = {
    "svg.fonttype": "none",
    "svg.hashsalt": "rclpy-grader",
    "font.size": 9,
    "axes.grid": True,
    "grid.alpha": 0.3,
}
_STYLE |= dict.fromkeys(("text.color", "axes.labelcolor", "xtick.color", "ytick.color", "axes.edgecolor"), "#808590")


def drawn(chart: Chart) -> bytes:
    """Return a chart as SVG, without a background."""
    with rc_context(_STYLE):
        heights = [0.5 + 0.35 * len(panel.lanes) if panel.lanes else 1.7 for panel in chart.panels]
        figure = MatplotlibFigure(figsize=(7.2, 5.0 if chart.square else 0.6 + sum(heights)), layout="constrained")
        axes = figure.subplots(len(heights), sharex=True, squeeze=False, height_ratios=heights)[:, 0]
        for ax, panel in zip(axes, chart.panels, strict=True):
            _draw(ax, panel)
            for case in chart.cases:
                ax.axvspan(case.start, case.stop, color=_COLOURS[case.tone.value], alpha=0.08)
            for moment in chart.moments:
                ax.axvline(moment.x, color=_COLOURS[moment.tone.value], linestyle=":")
            if chart.square:
                ax.set_aspect("equal", adjustable="datalim")
        axes[-1].set_xlabel(" ".join(filter(None, [chart.x_title, chart.x_unit and f"({chart.x_unit})"])))
        out = io.BytesIO()
        figure.savefig(out, format="svg", transparent=True, metadata={"Date": None})
    return out.getvalue()


_LOOKS: Mapping[str, Mapping[str, Any]] = {
    "line": {},
    "step": {"drawstyle": "steps-post"},
    "dots": {"linestyle": "", "marker": "o", "markersize": 3},
}


def _draw(ax: Axes, panel: Panel) -> None:
    for band in panel.bands:
        ax.axhspan(band.low, band.high, color=_COLOURS[band.tone.value], alpha=0.15, label=band.label)
    for level in panel.levels:
        ax.axhline(level.value, color="#8a8f98", linestyle="--", label=level.label)
    for series in panel.series:
        x, y = [p[0] for p in series.points], [p[1] for p in series.points]
        ax.plot(x, y, color=_COLOURS[series.tone.value], label=series.name, **_LOOKS[series.look.value])
    if panel.lanes:
        ax.set_yticks(range(len(panel.lanes)), panel.lanes, fontsize=7)
        ax.set_ylim(len(panel.lanes) - 0.5, -0.5)
    ax.set_title(" ".join(filter(None, [panel.title, panel.unit and f"({panel.unit})"])), loc="left", fontsize=9)
    ax.legend(loc="center left", bbox_to_anchor=(1, 0.5), fontsize=7, frameon=False)


# --- the public interface ---------------------------------------------------------------------------------------------


def interface() -> str:
    """Return a section for each topic of `grader.api`: signature and docstring of each name."""
    own = "\n\n".join(_public(api, name) for name in ("grade", "observe", "rejudge"))
    return f"## Grade, observe, judge again\n\n{own}\n\n{_topics(api)}"


def unstable() -> str:
    """Return the same for `grader.api.unstable`."""
    return _topics(unstable_api)


def _topics(door: ModuleType) -> str:
    sections = []
    for title, homes in door.CONTENTS.items():
        names = [name for each in homes.values() for name in each.split()]
        sections.append(f"## {title}\n\n" + "\n\n".join(_public(door, name) for name in names))
    return "\n\n".join(sections)


def about(door: ModuleType, name: str) -> str:
    """Return the docstring of a name of `grader.api`, or the comment above a constant or a type of parameters."""
    value = inspect.unwrap(getattr(door, name))  # one that remembers results is a function too
    if inspect.isfunction(value) or (inspect.isclass(value) and not hasattr(value, "__args__")):
        return inspect.cleandoc(value.__doc__ or "")
    home = next(home for homes in door.CONTENTS.values() for home, names in homes.items() if name in names.split())
    file = Path(str(sys.modules[home].__file__))
    for path in (file, *sorted(file.parent.glob("*.py"))):  # a package hands on names of its modules
        lines = path.read_text(encoding="utf-8").split("\n")
        for index, line in enumerate(lines):
            if re.match(rf"{name}\b.*=", line):
                return _comment_above(lines, index)
    raise LookupError(f"{home}.{name}: expected an assignment, found none")


def _public(door: ModuleType, name: str) -> str:
    """Return the entry of one name."""
    value = inspect.unwrap(getattr(door, name))
    doc = about(door, name)
    if not (inspect.isfunction(value) or inspect.isclass(value)) or hasattr(value, "__args__"):
        text = re.sub(r"\b(?:[a-z_]+\.)+(?=[A-Z~])", "", repr(value)).replace("~", "")
        return f"### `{name}`\n\n`{text}`\n\n{doc}"
    text = f"### `{name}`\n\n"
    if inspect.isfunction(value):
        text += f"```text\n{name}{_plain(inspect.signature(value))}\n```\n\n"
    elif issubclass(value, Enum):
        text += f"One of {', '.join(f'`{member}`' for member in value.__members__)}.\n\n"
    elif not issubclass(value, Exception) and not getattr(value, "_is_protocol", False):
        text += f"```text\n{name}{_plain(inspect.signature(value))}\n```\n\n"
    return text + _as_markdown(doc) + _members(value)


def _plain(signature: inspect.Signature) -> str:
    """Return a signature with its annotations as they are written."""
    text = re.sub(r"<[^<>]* at 0x[0-9a-f]+>", "...", str(signature))
    return re.sub(r"(?<=: |> )'([^']*)'", r"\1", text).removesuffix(" -> None")


def _members(value: Any) -> str:
    """Return the methods and properties of a class that have a docstring, as a list."""
    if not inspect.isclass(value) or issubclass(value, (Exception, Enum)):
        return ""
    rows = []
    for name, member in vars(value).items():
        about = inspect.cleandoc(getattr(member, "__doc__", None) or "").split("\n\n")[0]
        if name.startswith("_") or not about or not (inspect.isfunction(member) or isinstance(member, property)):
            continue
        call = f"{name}{_plain(inspect.signature(member))}" if inspect.isfunction(member) else name
        call = call.replace("(self, ", "(").replace("(self)", "()").replace("|", "\\|")  # code needs no other escape
        rows.append(f"| `{call}` | {_cell(about)} |")
    return "\n\n| member | |\n|---|---|\n" + "\n".join(rows) if rows else ""


def _as_markdown(doc: str) -> str:
    """Return a docstring with its sections as lists."""
    lines = []
    for line in doc.split("\n"):
        if re.fullmatch(r"(Args|Attributes|Raises|Returns):", line):
            lines += [f"{line.replace('Args', 'Arguments')}", ""]
        elif found := re.fullmatch(r" {4}(\w+): (.*)", line):
            lines.append(f"- `{found[1]}`: {found[2]}")
        else:
            lines.append(line.removeprefix("    ") if line.startswith("        ") else line)
    return "\n".join(lines)


# --- limits -----------------------------------------------------------------------------------------------------------

#: Names of constants that bound something.
_BOUND = re.compile(
    r"_?(MOST|MAX|LONGEST|LARGEST|DEEPEST)(_|$)|.*(?<!NS_PER)_(BYTES|CHARACTERS|S|NS|MS|LIMIT|TRIES)$|_?(TRIES|DEPTH)$"
)
#: Packages whose bounds only shorten what is shown.
_SHOWN = (
    "grader/course/class_page/",
    "grader/course/mutation/",
    "grader/grading/reporting/",
    "grader/runtime/ros_packages/",
)
_UNITS = {name: value for name, value in vars(quantities).items() if isinstance(value, int)}


def limits() -> str:
    """Return a table of the constants that bound time, memory, sizes and counts, with their reasons, by module."""
    made = []
    for path in sorted((ROOT / "grader").rglob("*.py")):
        place = path.relative_to(ROOT).as_posix()
        rows = [] if place.startswith(_SHOWN) else list(bounds(path.read_text(encoding="utf-8")))
        if rows:
            table = "\n".join(f"| `{names}` | {value} | {_cell(why)} |" for names, value, why in rows)
            made.append(f"\n### `{place}`\n\n| limit | value | why |\n|---|---|---|\n{table}\n")
    return "".join(made)


def bounds(source: str) -> Iterator[tuple[str, str, str]]:
    """Yield the bounds in the text of a module: their names, their values in words, and the comment above each."""
    lines = source.split("\n")
    for node in ast.parse(source).body:
        if not isinstance(node, (ast.Assign, ast.AnnAssign)) or node.value is None:
            continue
        target = node.targets[0] if isinstance(node, ast.Assign) else node.target
        names = [
            one.id for one in (target.elts if isinstance(target, ast.Tuple) else [target]) if isinstance(one, ast.Name)
        ]
        values = _numbers(node.value)
        if len(values) == len(names) and any(map(_BOUND.fullmatch, names)):
            said = ", ".join(_amount(name, value) for name, value in zip(names, values, strict=True))
            yield ", ".join(names), said, _comment_above(lines, node.lineno - 1)


def _comment_above(lines: list[str], index: int) -> str:
    found: list[str] = []
    while lines[index - 1 - len(found)].startswith("#"):
        found.insert(0, lines[index - 1 - len(found)].lstrip("#: "))
    return " ".join(found) or lines[index].partition("  # ")[2]


def _numbers(node: ast.expr) -> list[float]:
    """Return the numbers of an expression; none if it has another value."""
    parts = node.elts if isinstance(node, ast.Tuple) else [node]
    found = []
    for part in parts:
        named = {one.id for one in ast.walk(part) if isinstance(one, ast.Name)}
        if not named <= _UNITS.keys() or not all(isinstance(one, _ARITHMETIC) for one in ast.walk(part)):
            return []
        value = eval(compile(ast.Expression(part), "limits", "eval"), {}, _UNITS)  # noqa: S307 - numbers and operators
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            return []
        found.append(value)
    return found


_ARITHMETIC = (ast.Constant, ast.Name, ast.Load, ast.BinOp, ast.UnaryOp, ast.operator, ast.unaryop)


def _amount(name: str, value: float) -> str:
    if name.endswith("BYTES"):
        return quantities.size(int(value))
    if name.endswith("_NS"):
        return quantities.duration(int(value))
    return f"{value:,} s" if name.endswith("_S") else f"{value:,}"


# --- exercises --------------------------------------------------------------------------------------------------------


def gallery() -> str:
    """Return a section for each exercise that ships with the grader: its files, its criteria, and a report."""
    explained = [e for e in explain_rubrics() if isinstance(e, CriterionExplanation)]
    return "\n\n".join(_exercise(e, explained) for e in exercises().values())


def _exercise(exercise: Exercise, explained: list[CriterionExplanation]) -> str:
    mine = [e for e in explained if e.exercise.endswith(f"({exercise.id})")]
    files = ", ".join(f"`{file}`" for file in exercise.files)
    points = sum(e.points for e in mine)
    checks_used = [f"[`{e.check}`](reference/checks.md#{e.check})" for e in mine]
    rows = [
        f"| {_cell(e.title)} `{e.id}` | {float(e.points):g} | {check} |"
        for e, check in zip(mine, checks_used, strict=True)
    ]
    lines = [
        f'<a id="{exercise.id}"></a>\n\n## {exercise.title}',
        f"{files}; {float(points):g} points; `grade . --exercise {exercise.id}`",
        "\n".join(["| criterion | points | check |", "|---|---|---|", *rows]),
        _on_site(f"[A report of a real submission](examples/{exercise.id}.html), with one mistake."),
        f"To see a report of a submission with one mistake: `grade {_place(EXAMPLES[exercise.id])} "
        f"--exercise {exercise.id} --open`",
    ]
    return "\n\n".join(lines)


def _place(submission: str) -> str:
    return sample_folders.folder_of(submission).relative_to(ROOT).as_posix()


def _on_site(text: str) -> str:
    """Return text that only the site shows."""
    return f"<!-- site: {text.replace('--', '-')} -->"


def examples() -> str:
    """Return a section for each example exercise: what it asks, its criteria, and what typical mistakes lose."""
    folders = sorted(page.parent for page in (ROOT / "examples").glob("*/README.md"))
    return "\n\n".join(map(_example, sorted(folders, key=lambda folder: _rubric(folder).number)))


@cache
def _rubric(folder: Path) -> Exercise:
    return read_rubric(folder / f"{folder.name}.yaml")


def _example(folder: Path) -> str:
    exercise = _rubric(folder)
    title, _, rest = (folder / "README.md").read_text(encoding="utf-8").partition("\n\n")
    about, shows = rest.partition("## Grade it")[0].strip(), rest.partition("## What it shows")[2].strip()
    points = sum(c.points for c in exercise.criteria)
    command = f"grade FOLDER --rubric examples/{folder.name}/{folder.name}.yaml"
    lost = YAML(typ="safe").load((folder / "expected.yaml").read_text(encoding="utf-8"))
    lines = [
        f'<a id="{exercise.id}"></a>\n\n## {title.removeprefix("# ")}',
        about,
        f"{', '.join(f'`{file}`' for file in exercise.files)}; {float(points):g} points; `{command}`",
        "\n".join(["| criterion | points | check |", "|---|---|---|", *map(_example_row, exercise.criteria)]),
        f"[The files](../examples/{folder.name}/): rubric, reference, and submissions with a mistake:",
        "\n".join(f"- `{wrong}` loses {', '.join(f'`{c}`' for c in found)}" for wrong, found in lost.items()),
        "What it shows of the grammar:",
        shows,
    ]
    return "\n\n".join(lines)


def _example_row(criterion: Criterion) -> str:
    name = check_name(criterion)
    check = f"[`{name}`](reference/checks.md#{name})" if name in known_checks() else f"`{name}`, its own"
    return f"| {_cell(criterion.title)} `{criterion.id}` | {float(criterion.points):g} | {check} |"


@cache
def exercises() -> dict[str, Exercise]:
    """Return the exercises that ship with the grader, by id."""
    return archive.exercises_by_id()


@cache
def example_report(exercise: str) -> Report:
    """Return the report of the recorded submission that stands for an exercise."""
    return archive.judged(archive.recordings()[EXAMPLES[exercise]])


def files() -> dict[str, str | bytes]:
    """Return the files of the site other than pages, by their path: the reports of the examples, and the charts."""
    reports = {f"examples/{exercise}.html": render_html(example_report(exercise)) for exercise in exercises()}
    return reports | {f"reference/charts/{check}.svg": drawn(chart) for check, chart in charts().items()}


NAMES: Mapping[str, Callable[[], str]] = {
    "commands": commands,
    "checks": checks,
    "grammar": grammar,
    "gallery": gallery,
    "examples": examples,
    "interface": interface,
    "unstable": unstable,
    "limits": limits,
}

_PART = re.compile(r"(<!-- generated: (\w+) -->)\n.*?(<!-- end of generated: \2 -->)", re.DOTALL)
_FOR_SITE = re.compile(r"<!-- site: (.*?) -->", re.DOTALL)


def renewed(markdown: str) -> str:
    """Return a page with its generated parts made anew."""
    return _PART.sub(lambda found: f"{found[1]}\n\n{NAMES[found[2]]().strip()}\n\n{found[3]}", markdown)


def for_site(markdown: str) -> str:
    """Return a page with the text that only the site shows."""
    return _FOR_SITE.sub(lambda found: found[1], markdown)


def main() -> None:
    """Renew the generated parts of all pages."""
    for page in sorted((ROOT / "docs").rglob("*.md")):
        text = page.read_text(encoding="utf-8")
        new = renewed(text)
        if new != text:
            page.write_text(new, encoding="utf-8")
            print(f"renewed: {page.relative_to(ROOT)}")


if __name__ == "__main__":
    main()
