"""Notes that recording writes and judging adds to: the same function words them for both."""

from __future__ import annotations


def main_not_called(file: str, line: int = 0) -> str:
    """Return the note on a file in which nothing calls main().

    Args:
        file: Its path in the submission.
        line: The line of main, from 1; 0 leaves it out.
    """
    place = f"{file}:{line}" if line else file
    said = f"{place}: nothing calls main(), so `python3 {file}` would do nothing"
    return f"{said}; add: if __name__ == '__main__': main()"
