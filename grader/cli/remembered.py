"""The options of `grade batch` that its results folder keeps, as the defaults of the next run."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import click

from grader.cli.options import complain
from grader.grading.model.grading_options import BATCH, option_names
from grader.runtime.model.wording import printable

if TYPE_CHECKING:
    from grader.course.classroom.last_run import LastRun

#: The option whose values have a topic in front of a path.
_BAGS = "bags"

#: Parameters of `grade batch` that change marks, pages or exported files. The others concern one run only.
KEPT = (
    "layout",
    "pattern",
    "roster",
    "adjustments",
    *option_names(BATCH),
    "seed_key",
    "title",
    "standalone",
    "canvas",
    "canvas_gradebook",
    "moodle",
    "gradescope",
)
#: A given option replaces each of these, not only itself: both together would be refused, or one would be ignored.
_REPLACES = {
    "seed": ("seed_key",),
    "seed_key": ("seed",),
    "layout": ("pattern",),
    "pattern": ("layout",),
    "exercises": ("every",),
    "every": ("exercises",),
}
#: Options that mean nothing without another one.
_NEEDS = {"canvas_gradebook": "canvas"}
_OPTIONS = "grader.batch.options"

#: Name of a parameter -> the texts given for it; none for an option without a value.
_Texts = dict[str, tuple[str, ...]]


def options_to_keep(ctx: click.Context) -> Mapping[str, tuple[str, ...]]:
    """Return the options of this run that the next one takes, by their names without dashes."""
    kept: Mapping[str, tuple[str, ...]] = ctx.meta.get(_OPTIONS, {})
    return kept


class ClassCommand(click.Command):
    """A command that takes the options in `KEPT` from `class.yaml` of its results folder, unless they are given."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Parse what is typed, with the options of the last run as defaults."""
        typed, _, _ = self.make_parser(ctx).parse_args(args=list(args))
        if typed.get("results") and not ctx.resilient_parsing:  # else a shell completes a word
            from grader.course.classroom.last_run import read_last_run

            file = Path(typed["results"])
            params = {p.name: p for p in self.params if isinstance(p, click.Option) and p.name in KEPT}
            given = {str(name): _texts(typed[name]) for name in params if name in typed}
            taken = _taken(read_last_run(file), file, params, given)
            if taken:
                said = ", ".join(_said(params[name], texts) for name, texts in taken.items())
                complain(f"from {_file(file)}: {said}; delete a line there to leave it out", kind="note")
            ctx.default_map = {name: _default(params[name], texts) for name, texts in taken.items()}
            every = {**given, **taken}
            ctx.meta[_OPTIONS] = {
                _name(params[name]): _changed(params[name], texts, os.path.abspath) for name, texts in every.items()
            }
        return super().parse_args(ctx, args)


def _taken(last: LastRun, results: Path, params: Mapping[str, click.Option], given: _Texts) -> _Texts:
    """Return the kept options that are neither given now nor replaced; raises ClassError for an unusable one."""
    from grader.runtime.model.errors import ClassError

    by_name = {_name(param): name for name, param in params.items()}
    for option, texts in last.options.items():
        if option not in by_name:
            known = ", ".join(sorted(by_name))
            raise ClassError(f"{_file(results)}: expected one of {known}, found `{printable(option)}`")
        param = params[by_name[option]]
        wanted = "true" if param.is_flag else "values" if param.multiple else "one value"
        if bool(texts) == param.is_flag or (len(texts) > 1 and not param.multiple):
            raise ClassError(f"{_file(results)}: {option}: expected {wanted}, found something else")
    replaced = {other for name in given for other in (name, *_REPLACES.get(name, ()))}
    taken = {by_name[option]: texts for option, texts in last.options.items() if by_name[option] not in replaced}
    for name, needed in _NEEDS.items():
        if needed not in given and needed not in taken:
            taken.pop(name, None)
    for name, texts in taken.items():
        for path in _paths(params[name], texts):
            if not os.path.lexists(path):
                where = f"{_file(results)}: --{_name(params[name])}: expected {path}"
                hint = f"give it again with --{_name(params[name])}, or delete the line to leave it out"
                raise ClassError(f"{where}, which the last run used, found nothing there", hint)
    return taken


def _file(results: Path) -> Path:
    from grader.course.classroom.last_run import RUN

    return results / RUN


def _default(param: click.Option, texts: tuple[str, ...]) -> object:
    """Return what click takes as the default of an option."""
    if param.is_flag:
        return True
    near = _changed(param, texts, _near)
    return list(near) if param.multiple else near[0]


def _said(param: click.Option, texts: tuple[str, ...]) -> str:
    return " ".join([f"--{_name(param)}", *_changed(param, texts, _near)])


def _name(param: click.Parameter) -> str:
    """Return the name of an option without dashes."""
    return param.opts[0].removeprefix("--")


def _changed(param: click.Option, texts: tuple[str, ...], changed: Callable[[str], str]) -> tuple[str, ...]:
    """Return the values of an option with their paths changed; a recording has a topic in front: `/scan=bags/scan`."""
    if param.name == _BAGS:
        parts = (text.partition("=") for text in texts)
        return tuple(f"{topic}={changed(path)}" for topic, _, path in parts)
    return tuple(map(changed, texts)) if isinstance(param.type, click.Path) else texts


def _paths(param: click.Option, texts: tuple[str, ...]) -> list[str]:
    if param.name == _BAGS:
        return [text.partition("=")[2] for text in texts]
    return list(texts) if isinstance(param.type, click.Path) else []


def _near(path: str) -> str:
    """Return a path as people write it: relative to this folder if it is below it."""
    relative = os.path.relpath(path)
    return path if relative.startswith("..") else relative


def _texts(raw: object) -> tuple[str, ...]:
    """Return what was typed for an option; nothing for an option without a value."""
    if isinstance(raw, bool):
        return ()
    return tuple(map(str, raw)) if isinstance(raw, (list, tuple)) else (str(raw),)
