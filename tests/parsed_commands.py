"""Parses commands that documents and files show, without running them."""

from __future__ import annotations

from contextlib import suppress

import click

from grader.cli.main import app

#: What stands for a value in commands, where a command needs one of a certain kind.
_STAND_INS = {
    "N": "1",
    "S": "10",
    "P": "60",
    "P%": "5%",
    "FORMAT=PATH": "json=report.json",
    "badge=badge.svg": "json=badge.svg",
    "OWNER/NAME@COMMIT": f"school/grader@{'0' * 40}",
}


def parsed(words: list[str]) -> None:
    """Parse a command without running it; raises click.ClickException if it has no such subcommand or option."""
    command: click.Command = app
    while isinstance(command, click.Group) and words:
        found = command.get_command(click.Context(command), words[0])
        if found is None:
            break
        command, words = found, words[1:]
    if command is app:
        command = app.default
    # In a sentence, `grade batch` and `grade rubric` name a command.
    if [word for word in words if not word.startswith("-")]:
        with suppress(click.exceptions.Exit):  # `--help`
            # A command keeps the help option that it has in its first context
            settings = {**app.context_settings, **command.context_settings}
            command.make_context("grade", [_STAND_INS.get(word, word) for word in words], **settings)
