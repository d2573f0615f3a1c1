"""Adds the line to notes about a main() that nothing calls."""

from __future__ import annotations

import ast
from collections.abc import Mapping

from grader.core.submission import Submission, main_not_called
from grader.judging.source import Source, first_line, last_name, read, text_of


def placed(notes: tuple[str, ...], submission: Submission, sources: Mapping[str, str]) -> tuple[str, ...]:
    """Return the notes; one that says that nothing calls main() names the line of the guard or of main itself."""
    files = {submission.files[name].found or name: text for name, text in sources.items()}
    uncalled = {main_not_called(file): file for file in files}
    return tuple(_placed(uncalled[note], files[uncalled[note]]) if note in uncalled else note for note in notes)


def _placed(file: str, text: str) -> str:
    source = read(file, text)
    guard = _wrong_guard(source)
    if guard is not None:
        said = (
            f"{file}:{first_line(guard)}: 'if {source.code(guard.test, 60)}' is never true, so `python3 {file}` would"
        )
        return f"{said} do nothing; write: if __name__ == '__main__':"
    main = next(iter(source.functions("main")), None)
    return main_not_called(file, first_line(main) if main is not None else 0)


def _wrong_guard(source: Source) -> ast.If | None:
    """Return the condition at the top of the file that was meant for the usual one."""
    for node in source.all(ast.If):
        test = node.test
        if source.function_of(node) is not None or not isinstance(test, ast.Compare):
            continue
        sides = [test.left, *test.comparators]
        texts = [t for s in sides if (t := text_of(s)) is not None]
        named = any(last_name(s) == "__name__" for s in sides)
        if (named and texts != ["__main__"]) or (not named and any("main" in t for t in texts)):
            return node
    return None
