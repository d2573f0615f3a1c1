"""A command that repeats the options of its last run into a folder, unless they are given again or left out."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from grader.cli.options import complain
from grader.grading.model.grading_options import BATCH, option_names

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
_OPTIONS, _LEFT_OUT = "grader.batch.options", "grader.batch.left_out"

#: Name of a parameter -> the texts given for it; none for an option without a value.
_Texts = dict[str, tuple[str, ...]]


def options_to_keep(ctx: click.Context) -> Mapping[str, tuple[str, ...]]:
    """Return the options of this run that the next one repeats, by their names without dashes."""
    kept: Mapping[str, tuple[str, ...]] = ctx.meta.get(_OPTIONS, {})
    return kept


def is_left_out(ctx: click.Context, name: str) -> bool:
    """Return whether a parameter was left out by `--no-OPTION`."""
    return name in ctx.meta.get(_LEFT_OUT, ())


class RepeatingCommand(click.Command):
    """A command that repeats the options in `KEPT` of its last run into a folder; `--no-OPTION` leaves one out."""

    def __init__(self, *arguments: Any, **attributes: Any) -> None:
        super().__init__(*arguments, **attributes)
        self._kept = {p.name: p for p in self.params if isinstance(p, click.Option) and p.name in KEPT}
        self.params += [
            click.Option([f"--no-{_name(param)}", _left_out(param)], is_flag=True, expose_value=False, hidden=True)
            for param in self._kept.values()
        ]

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Parse what is typed, together with the options of the last run that are not."""
        if ctx.resilient_parsing:  # a shell completes a word
            return super().parse_args(ctx, args)
        typed, _, _ = self.make_parser(ctx).parse_args(args=list(args))
        if not typed.get("results"):
            return super().parse_args(ctx, args)
        from grader.course.classroom.last_run import read_last_run

        given = {name: _texts(typed[name]) for name in self._kept if name in typed}
        dropped = {name for name, param in self._kept.items() if typed.get(_left_out(param))}
        for name in dropped & set(given):
            option = _name(self._kept[name])
            raise click.BadParameter(f"--{option} and --no-{option} exclude each other")
        last = read_last_run(Path(typed["results"]))
        repeated = self._repeated(last, given, dropped)
        self._tell(last, given, repeated)
        ctx.meta[_LEFT_OUT] = dropped
        ctx.meta[_OPTIONS] = {
            _name(self._kept[name]): self._absolute(name, texts) for name, texts in (given | repeated).items()
        }
        return super().parse_args(ctx, [*self._words(repeated), *args])

    def _repeated(self, last: LastRun, given: _Texts, dropped: set[str]) -> _Texts:
        """Return the options of the last run that are neither given now, nor left out, nor replaced."""
        by_name = {_name(param): name for name, param in self._kept.items()}
        before = {by_name[option]: texts for option, texts in last.options.items() if option in by_name}
        replaced = {other for name in given for other in (name, *_REPLACES.get(name, ()))}
        repeated = {name: texts for name, texts in before.items() if name not in replaced | dropped}
        for name, needed in _NEEDS.items():
            if needed not in given and needed not in repeated:
                repeated.pop(name, None)
        for name, texts in repeated.items():
            self._check(name, texts, last)
        return repeated

    def _check(self, name: str, texts: tuple[str, ...], last: LastRun) -> None:
        """Raise ClassError if the last run used a file that is no longer there."""
        from grader.runtime.model.errors import ClassError

        gone = [path for text in texts if self._is_path(name) and not os.path.lexists(path := _split(name, text)[1])]
        if gone:
            option = _name(self._kept[name])
            holds = f" ({_decisions(last.decisions)})" if name == "adjustments" else ""
            message = f"--{option}: expected {gone[0]}{holds}, which the last run used, found nothing there"
            raise ClassError(message, f"give it again with --{option}, or leave it out with --no-{option}")

    def _tell(self, last: LastRun, given: _Texts, repeated: _Texts) -> None:
        """Say which options are repeated, and which others than those of the last run are given."""
        if repeated:
            said = [self._said(name, texts, last) for name, texts in repeated.items()]
            leave_out = " or ".join(f"--no-{_name(self._kept[name])}" for name in list(repeated)[:2])
            complain(f"as in the last run: {', '.join(said)}; {leave_out} leaves it out", kind="note")
        for name, texts in given.items():
            before = last.options.get(_name(self._kept[name]))
            if before is not None and before != self._absolute(name, texts):
                now, then = self._said(name, texts), self._said(name, before)
                complain(f"{now}; the last run had {then}", kind="note")

    def _said(self, name: str, texts: tuple[str, ...], last: LastRun | None = None) -> str:
        values = [_with_path(name, text, _near) if self._is_path(name) else text for text in texts]
        option = f"--{_name(self._kept[name])}"
        holds = f" ({_decisions(last.decisions)})" if last is not None and name == "adjustments" else ""
        return " ".join([option, *values]) + holds

    def _words(self, repeated: _Texts) -> Iterator[str]:
        for name, texts in repeated.items():
            option = f"--{_name(self._kept[name])}"
            yield from [
                f"{option}={_with_path(name, text, _near) if self._is_path(name) else text}" for text in texts
            ] or [option]

    def _absolute(self, name: str, texts: tuple[str, ...]) -> tuple[str, ...]:
        absolute = os.path.abspath  # follows no link
        return tuple(_with_path(name, text, absolute) for text in texts) if self._is_path(name) else texts

    def _is_path(self, name: str) -> bool:
        return name == _BAGS or isinstance(self._kept[name].type, click.Path)


def _name(param: click.Parameter) -> str:
    """Return the name of an option without dashes."""
    return param.opts[0].removeprefix("--")


def _split(name: str, text: str) -> tuple[str, str]:
    """Split what was typed for an option in front of its path: a recording has a topic there, `/scan=bags/scan`."""
    topic, equals, path = text.partition("=") if name == _BAGS else ("", "", text)
    return topic + equals, path


def _with_path(name: str, text: str, changed: Callable[[str], str]) -> str:
    before, path = _split(name, text)
    return before + changed(path)


def _near(path: str) -> str:
    """Return a path as people write it: relative to this folder if it is below it."""
    relative = os.path.relpath(path)
    return path if relative.startswith("..") else relative


def _left_out(param: click.Parameter) -> str:
    """Return the name of the parameter that leaves an option out."""
    return f"without_{param.name}"


def _texts(raw: object) -> tuple[str, ...]:
    """Return what was typed for an option; nothing for an option without a value."""
    if isinstance(raw, bool):
        return ()
    return tuple(map(str, raw)) if isinstance(raw, (list, tuple)) else (str(raw),)


def _decisions(count: int) -> str:
    return f"{count} decision{'' if count == 1 else 's'}"
