"""Turns the codes that a student's process reports into notes, and checks the files and lines that it names."""

from __future__ import annotations

import os
import re
import stat
from collections.abc import Callable, Mapping
from pathlib import Path, PurePosixPath

from grader.runtime.host.protocol import Note, NotEvaluated
from grader.runtime.model.limits import MAX_FILE_BYTES, MOST_LAUNCHED
from grader.runtime.model.trace import Start, StartWay, main_not_called

#: The full name of a node.
_NODE = re.compile(r"(?:/[A-Za-z_][A-Za-z0-9_]{0,99}){1,20}")
#: The highest ROS domain that has ports for its participants.
MOST_DOMAIN = 232
#: A longer path in a report is not looked for: the process is not trusted.
NAME_CHARACTERS = 300


class Places:
    """The files of a staged submission, read when they are first asked for.

    Args:
        root: The staged folder; None for a submission without files.
    """

    def __init__(self, root: Path | None) -> None:
        self._root = root
        self._lines: dict[str, int] = {}

    def has(self, file: object, line: object = 1) -> bool:
        """Return whether a file of the submission has a line; the path is relative and normalized."""
        return isinstance(file, str) and type(line) is int and 1 <= line <= self.lines(file)

    def lines(self, file: str) -> int:
        """Return the number of lines of a file, at least 1; 0 for anything that is not a file of the submission."""
        if len(file) > NAME_CHARACTERS or file in ("", ".") or str(PurePosixPath(file)) != file:
            return 0
        if file not in self._lines:
            if len(self._lines) >= 2_000:
                return 0
            self._lines[file] = self._count(file)
        return self._lines[file]

    def _count(self, file: str) -> int:
        if self._root is None or file.startswith("/") or ".." in file.split("/") or "\0" in file:
            return 0
        path = self._root / file
        try:
            if path.resolve() != self._root.resolve() / file:
                return 0
            with open(path, "rb", opener=_without_waiting) as source:
                if not stat.S_ISREG(os.fstat(source.fileno()).st_mode):
                    return 0
                return max(1, len(source.read(MAX_FILE_BYTES).splitlines()))
        except (OSError, ValueError):
            return 0


def _without_waiting(path: str, flags: int) -> int:
    """Open a file without following a symlink and without blocking on a pipe."""
    return os.open(path, flags | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC)


#: What can be said of something that a launch file has and the grader does not evaluate, by its code. Names and texts
#: are the student's: a name that does not match is not shown, a text is quoted.
_LEFT_OUT: Mapping[str, tuple[str, re.Pattern[str] | None]] = {
    "action": ("the action {name}", re.compile(r"[A-Za-z_][A-Za-z0-9_]{0,59}")),
    "command": ("the command {text}", None),
    "handler": ("the event handler {name}", re.compile(r"On[A-Z][A-Za-z]{0,39}")),
    "launch_file": ("the launch file {name}", re.compile(r"[A-Za-z0-9_.-]{1,80}")),
    "module": ("what needs the package {name}", re.compile(r"[a-z0-9_]{1,80}")),
    "name": ("what needs {name}", re.compile(r"[A-Za-z_]\w*(?:\.[A-Za-z_]\w*){0,6}", re.ASCII)),
    "node_argument": ("{name}= of a node", re.compile(r"[a-z_]{1,40}")),
    "nodes": (f"a node beyond the first {MOST_LAUNCHED}", None),
    "package": ("what needs the package {name}", re.compile(r"[A-Za-z0-9_-]{1,80}")),
    "parameter_file": ("the parameter file {name}", re.compile(r"[A-Za-z0-9_.-]{1,80}")),
    "substitution": ("the substitution {name}({text})", re.compile(r"[A-Z][A-Za-z]{0,39}")),
    "variable": ("the environment variable {name}", re.compile(r"[A-Za-z_][A-Za-z0-9_]{0,79}")),
    "written_file": ("writing the file {name}", re.compile(r"[A-Za-z0-9_.-]{1,80}")),
}
#: Why something is left out that would be understood otherwise, by its code.
_WHY = {
    "handler": "only lists of actions for the start or the end of a process are done",
    "launch_file": "its ending is not that of a launch file",
    "module": "this package is not installed",
    "nodes": "no more are started",
    "package": "the submission has no such package",
    "parameter_file": "it is not there",
    "written_file": "a launch file may write only below share folders and in temporary folders",
}
#: No launch file describes so many nodes in the time that it has.
MOST_COUNTED = 1_000_000
#: As much of a student's text as fits into a line of a note.
_QUOTED_CHARACTERS = 80


def quoted(text: str) -> str:
    """Return a student's text on one line in quotes, shortened; it cannot close them."""
    plain = " ".join("".join(c if c.isprintable() else " " for c in text[: 4 * _QUOTED_CHARACTERS]).split())
    plain = plain.replace('"', "'")
    return f'"{plain[: _QUOTED_CHARACTERS - 1]}…"' if len(plain) > _QUOTED_CHARACTERS else f'"{plain}"'


def left_out_words(told: NotEvaluated) -> str:
    """Return the words for something of a launch file that is not evaluated.

    Args:
        told: What a process reports of it.
    """
    words, known = _LEFT_OUT.get(told.code, ("something", None))
    name = told.name if known is None or known.fullmatch(told.name) else quoted(told.name)
    return words.format(name=name, text=quoted(told.text))


def left_out_sentence(told: NotEvaluated) -> str:
    """Return what `left_out_words` says as a sentence, with the reason."""
    why, words = _WHY.get(told.code), left_out_words(told)
    if told.code == "nodes" and 1 < told.times < MOST_COUNTED:
        return f"{told.times} nodes beyond the first {MOST_LAUNCHED} were left out: {why}"
    sentence = f"{words} was left out: {why}" if why else f"{words} is not supported and was left out"
    return f"{sentence}; the launch file was evaluated no further" if told.ends else sentence


_WAYS = {way.value: way for way in StartWay}
#: The longest name of a function in a note.
_NAME_CHARACTERS = 100
#: The dotted name of a module. Folder names may contain spaces, parentheses and hyphens.
_TARGET = re.compile(r"[\w.() -]{1,300}")


def note_of(file: str, data: Note, places: Places) -> str:
    """Return the note for a code; empty if the code is unknown or names something impossible.

    Args:
        file: The file that the process runs.
        data: The report.
        places: The files of the submission.
    """
    say = NOTES.get(data.code)
    return say(file, data, places) if say is not None else ""


def reported_start(process: str, file: str, data: Note, places: Places) -> Start | None:
    """Return how a process reports that its file is started; None if the report is not valid.

    Args:
        process: Name of the process.
        file: The file that it runs.
        data: The report.
        places: The files of the submission.
    """
    way, module, function = _WAYS.get(data.way), data.module, data.function
    if way is None or module is None or function is None:
        return None
    stem = file.rpartition("/")[2].rpartition(".")[0]
    named = all(map(_is_name, function.split("."))) if function else True
    if way is not StartWay.SCRIPT and (not named or module.rpartition(".")[2] != stem or not _TARGET.fullmatch(module)):
        return None
    target = "" if way is StartWay.SCRIPT else f"{module}:{function}" if function else module
    kept = [name for name in data.hidden if _is_there(name, file, places)]
    return Start(process, file, way, target, tuple(kept))


def hidden_notes(start: Start) -> list[str]:
    """Return a note for each file that hides a module."""
    need = "has the name of a module that Python or ROS needs: `python3` imports it instead; rename it"
    return [f"{name} {need}" for name in start.hidden]


def _is_there(name: str, file: str, places: Places) -> bool:
    """Return whether a module is in the folder of a file or in a parent folder."""
    if "/" in name:
        return False
    folders = [file]
    while folders[-1]:
        folders.append(folders[-1].rpartition("/")[0])
    paths = [f"{folder}/{name}".lstrip("/") for folder in folders[1:]]
    return any(places.has(path) or places.has(f"{path}/__init__.py") for path in paths)


def _main_not_called(file: str, data: Note, places: Places) -> str:
    del data, places
    return main_not_called(file)


def _class_not_started(file: str, data: Note, places: Places) -> str:
    del places
    name = data.class_name
    if not _is_name(name):
        return ""
    problem = f"{file}: nothing starts {name}, so `python3 {file}` would do nothing"
    return f"{problem}; add a main() that calls rclpy.init(), makes the node and spins it"


def _neighbour_imported(file: str, data: Note, places: Places) -> str:
    name = data.module
    if not _is_name(name) or not places.has(f"{file.rpartition('/')[0]}/{name}.py".lstrip("/")):
        return ""
    problem = f"{file}: import {name} finds {name}.py beside it with `python3` only, not with `ros2 run`"
    return f"{problem}; in a package, write: from . import {name}"


def _other_domain(file: str, data: Note, places: Places) -> str:
    del places
    node, domain = data.node, data.domain
    if not _NODE.fullmatch(node) or domain is None or not 0 <= domain <= MOST_DOMAIN:
        return ""
    problem = f"{file}: the node {node} is in the ROS domain {domain}, where the grader does not see it"
    return f"{problem}; remove what sets domain_id or ROS_DOMAIN_ID"


def _is_name(name: object) -> bool:
    return isinstance(name, str) and name.isidentifier() and len(name) <= _NAME_CHARACTERS


#: Every code that a process may send, with the function that words its note.
NOTES: Mapping[str, Callable[[str, Note, Places], str]] = {
    "main_not_called": _main_not_called,
    "class_not_started": _class_not_started,
    "neighbour_imported": _neighbour_imported,
    "other_domain": _other_domain,
}
