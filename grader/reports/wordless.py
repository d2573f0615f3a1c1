"""Sentences without their numbers: words in the place of what was measured, expected or written by a program."""

from __future__ import annotations

import re

#: Unit behind a number -> what stands for both.
_UNITS = {
    "Hz": "a rate",
    "s": "a time",
    "ms": "a time",
    "m/s": "a speed",
    "rad/s": "an angular speed",
    "m": "a distance",
    "rad": "an angle",
    "°C": "a temperature",
    "%": "a share",
}
_NUMBER = "a number"
# The number of bits is part of a type's name; any other digits might have been chosen by the program that said them.
_KEPT = re.compile(r"\b[a-z_]+/(?:msg|srv|action)/[A-Za-z]+(?:8|16|32|64)?(?:MultiArray)?(?!\w)")
_LINE = re.compile(r"(\.py):[0-9]+")
# Between two of these signs stands one word.
_WORD = re.compile(r"[^\s(),;:=\[\]{}<>|\"'`/±*\u00d7\u2018-\u201f]+")
_SIGNS = "+-\N{MINUS SIGN}"
_WORDS_FOR_VALUES = ("nan", "inf", "infinity")
_ONE = rf"(?:{_NUMBER}|{'|'.join(sorted(set(_UNITS.values()), key=len, reverse=True))})"
_ROW = re.compile(rf"{_ONE}(?:(?: ?[±/*,\u00d7] ?|:| to | and | or ){_ONE})+")
_WITH_UNIT = re.compile(rf"{_NUMBER} ?({'|'.join(sorted(map(re.escape, _UNITS), key=len, reverse=True))})(?![\w/])")


def without_numbers(text: str) -> str:
    """Return a sentence in which words stand for numbers.

    Names of message types stay whole, places in Python files lose their line, and of any other word with digits in it
    there is left what comes before the first one.
    """
    text = _LINE.sub(r"\1", text)
    parts, end = [], 0
    for kept in _KEPT.finditer(text):
        parts += [_worded(text[end : kept.start()]), kept.group()]
        end = kept.end()
    return "".join([*parts, _worded(text[end:])])


def _worded(text: str) -> str:
    plain = _WORD.sub(lambda match: _word(match.group()), text)
    return _ROW.sub(_row, _WITH_UNIT.sub(lambda match: _UNITS[match[1]], plain))


def _row(match: re.Match[str]) -> str:
    """Return what stands for several numbers in a row: what the last one is, if it has a unit."""
    last = next((word for word in _UNITS.values() if match.group().endswith(f" {word}")), "")
    return last or "numbers"


def _word(word: str) -> str:
    """Return a word as it is if nothing in it is a digit of any script."""
    if word.strip(f"{_SIGNS}.").casefold() in _WORDS_FOR_VALUES:
        return _NUMBER
    first = next((n for n, sign in enumerate(word) if sign.isnumeric()), -1)
    if first < 0:
        return word
    before = word[:first].strip(f"{_SIGNS}±~≈.#")
    after = "." if word.endswith(".") else ""
    return f"{before}…{after}" if before else f"{_NUMBER}{after}"
