"""The command `grade completion`, and what shells complete: names are read from files, the grader is not imported."""

from __future__ import annotations

import contextlib
import os
import re
import shlex
from collections.abc import Iterator
from pathlib import Path

import click
from click.shell_completion import BashComplete, CompletionItem, add_completion_class, get_completion_class

from grader.cli.options import print_for_programs
from grader.grading.model.rubric_files import rubrics_in
from grader.grading.reporting.formats import EVIDENCE, FORMATS, added_formats
from grader.runtime.model.errors import ALL_MET
from grader.runtime.shipped import shipped

_Items = list[CompletionItem[str]]
_VARIABLE = "_GRADE_COMPLETE"
#: The id of a rubric's exercise, at the place where all rubrics have it.
_EXERCISE = re.compile(r"^exercise:\n(?:  .*\n)*?  id: *([\w-]+)", re.MULTILINE)
_CRITERION = re.compile(r"^  - id: *([\w-]+)", re.MULTILINE)
#: Completion in zsh has to be switched on first; many set-ups do so.
_ZSH = "(( $+functions[compdef] )) || { autoload -Uz compinit && compinit; }"


@click.command(name="completion")
@click.argument("shell", type=click.Choice(["bash", "zsh", "fish"]))
@click.pass_context
def command(ctx: click.Context, shell: str) -> int:
    """Print a script that makes a shell complete commands, options, exercises, formats and files.

    \b
    bash: grade completion bash >> ~/.bashrc
    zsh:  grade completion zsh >> ~/.zshrc
    fish: grade completion fish > ~/.config/fish/completions/grade.fish
    """  # noqa: D301  click keeps the lines after a backspace
    root = ctx.find_root()
    made = get_completion_class(shell)
    assert made is not None
    script = made(root.command, {}, "grade", _VARIABLE).source()
    if shell == "zsh":
        first, _, rest = script.partition("\n")
        script = f"{first}\n{_ZSH}\n{rest}"
    print_for_programs(script)
    return ALL_MET


@add_completion_class
class _Bash(BashComplete):
    """Completion for bash, which splits words at `=`: they are joined again, and only the last part is replaced."""

    _kept = ""  # what precedes the part that bash replaces

    def get_completion_args(self) -> tuple[list[str], str]:
        """Return the words before the cursor, and the one at the cursor."""
        words, joined = super().get_completion_args(), [""]
        for word in (*words[0], words[1]):
            if word == "=" or joined[-1].endswith("="):
                joined[-1] += word
            else:
                joined.append(word)
        *args, incomplete = joined[1:]
        if words[1] == "=" or incomplete != words[1]:
            self._kept = incomplete[: incomplete.rindex("=") + 1]
        return args, incomplete

    def format_completion(self, item: CompletionItem[str]) -> str:
        """Write an item as the script reads it; the shell takes a value as if it were typed."""
        value = item.value.removeprefix(self._kept)
        return f"{item.type},{shlex.quote(value) if item.type == 'plain' else value}"


def complete_file(ctx: click.Context, param: click.Parameter, incomplete: str) -> _Items:
    """Leave it to the shell to complete a path."""
    del ctx, param
    return [CompletionItem(incomplete, type="file")]


def complete_exercise(ctx: click.Context, param: click.Parameter, incomplete: str) -> _Items:
    """Complete the id of an exercise, of the rubrics on the command line or of the built-in ones."""
    del param
    return _starting(incomplete, (match[1] for text in _rubrics(ctx) if (match := _EXERCISE.search(text))))


def complete_criterion(ctx: click.Context, param: click.Parameter, incomplete: str) -> _Items:
    """Complete the id of a criterion, of the same rubrics."""
    del param
    return _starting(incomplete, (id_ for text in _rubrics(ctx) for id_ in _CRITERION.findall(_criteria(text))))


def complete_output(ctx: click.Context, param: click.Parameter, incomplete: str) -> _Items:
    """Complete FORMAT=PATH: a format with a usual file name, and paths after the `=`."""
    del ctx, param
    usual = {name: f"report{format_.suffix}" for name, format_ in FORMATS.items()} | {EVIDENCE: "evidence"}
    # What is pressed often imports no other package to learn its suffix
    usual |= {name: f"report.{name}" for name in added_formats()}
    name, equals, path = incomplete.partition("=")
    if not equals:
        return _starting(incomplete, (f"{name}={file}" for name, file in usual.items()))
    return [CompletionItem(f"{name}={found}") for found in _paths(path, usual.get(name, ""))]


def _paths(begun: str, file: str) -> Iterator[str]:
    """Yield the files and folders that a path may mean.

    With a folder comes a new file in it: as the only choice, shells would end the word after the folder.
    """
    folder, name = os.path.split(begun)
    try:
        found = sorted(os.scandir(folder or "."), key=lambda entry: entry.name)
    except OSError:
        return
    for entry in found:
        if entry.name.startswith(name) and entry.name.isprintable() and (name or not entry.name.startswith(".")):
            path = os.path.join(folder, entry.name)  # noqa: PTH118  keeps a path as it was typed
            yield from (f"{path}/", f"{path}/{file}") if entry.is_dir() else (path,)


def _starting(incomplete: str, names: Iterator[str]) -> _Items:
    return [CompletionItem(name) for name in dict.fromkeys(names) if name.startswith(incomplete)]


def _rubrics(ctx: click.Context) -> Iterator[str]:
    """Yield the texts of the rubrics on the command line, or else of the built-in ones."""
    for path in ctx.params.get("rubrics") or rubrics_in(shipped("rubrics")):
        with contextlib.suppress(OSError, UnicodeDecodeError):
            yield Path(path).read_text(encoding="utf-8")


def _criteria(text: str) -> str:
    return text.partition("\ncriteria:")[2]
