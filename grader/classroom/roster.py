"""The people of a class, from whatever CSV file a platform exports, and which submission is whose."""

from __future__ import annotations

import csv
import io
import re
import unicodedata
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from grader.classroom.intake import HandedInEntry
from grader.core.errors import ClassError
from grader.submissions.collected import listed, shown

#: Largest CSV file that is read, and most rows.
MAX_BYTES = 8 << 20
MAX_ROWS = 20_000

#: What a column holds -> how platforms call it, in lower case.
COLUMNS: Mapping[str, tuple[str, ...]] = {
    "name": ("name", "student", "student name", "full name", "fullname"),
    "first": ("first name", "first_name", "firstname", "given name", "given_name"),
    "last": ("last name", "last_name", "lastname", "surname", "family name", "family_name"),
    "user": ("username", "user", "login", "github_username", "github username", "sis login id", "login id"),
    "email": ("email address", "email", "e-mail", "e-mail address"),
    "id": ("id number", "idnumber", "sis user id", "student id", "student_id", "student number", "sid"),
    "canvas": ("id",),
    "identifier": ("identifier",),
    "folder": ("folder", "submission", "directory"),
}
#: Columns that tell one person from another without doubt.
_EXACT = ("folder", "user", "email", "id", "canvas", "identifier")
# Moodle's grading worksheet writes `Participant 657693`, its download only the number.
_PARTICIPANT = re.compile(r"\D+ (\d+)")


@dataclass(frozen=True, slots=True)
class Person:
    """Somebody on the roster.

    Attributes:
        name: As people read it.
        user: User name on the platform; empty if the roster has none.
        email: Address; empty if the roster has none.
        id: Number of the institution; empty if the roster has none.
        handles: All that tells this person from others, folded.
        names: Ways to write the name, without spaces and accents.
        row: Column -> value, as the roster has it.
    """

    name: str
    user: str = ""
    email: str = ""
    id: str = ""
    handles: frozenset[str] = frozenset()
    names: frozenset[str] = frozenset()
    row: Mapping[str, str] | None = None


def fold_handle(text: str) -> str:
    """Return a handle so that the same one is always written in one way."""
    return unicodedata.normalize("NFKC", text).strip().casefold()


def fold_name(text: str) -> str:
    """Return a name as letters and digits only, without accents: `Ada O'Möhr` and `adaomohr` are the same."""
    plain = unicodedata.normalize("NFKD", text).casefold()
    return "".join(c for c in plain if c.isalnum())


def read_table(path: Path) -> tuple[list[str], list[dict[str, str]]]:
    """Return the header and the rows of a CSV file; commas, semicolons or tabs between the cells.

    Raises:
        ClassError: The file cannot be read, or has no header and rows.
    """
    text = _text(path)
    first = text.split("\n", 1)[0]
    delimiter = max(",;\t", key=first.count)
    try:
        rows = list(csv.reader(io.StringIO(text, newline=""), delimiter=delimiter))
    except csv.Error as error:
        raise ClassError(f"{path}: expected CSV, found a file that is none: {error}") from None
    rows = [row for row in rows if any(cell.strip() for cell in row)]
    if len(rows) < 2:
        raise ClassError(f"{path}: expected a header and rows, found {len(rows)} lines")
    if len(rows) > MAX_ROWS:
        raise ClassError(f"{path}: expected at most {MAX_ROWS} rows, found more")
    header = rows[0]
    return header, [dict(zip(header, [*row, *[""] * len(header)], strict=False)) for row in rows[1:]]


def read_roster(path: Path) -> list[Person]:
    """Return the people of a roster: a CSV file as Canvas, Moodle, GitHub or Classroom 50 export it, or one's own.

    Raises:
        ClassError: The file cannot be read, or no column tells who somebody is.
    """
    header, rows = read_table(path)
    columns = columns_of(header)
    if not columns:
        known = listed([names[0] for names in COLUMNS.values()])
        found = listed([shown(name, 30) for name in header[:6]], "and")
        raise ClassError(f"{path}:1: expected a column {known}, found {found}", "name the columns in the first line")
    return [person for row in rows if not _is_noperson_of(row) and (person := person_of(row, columns)).name]


def columns_of(header: Sequence[str]) -> dict[str, list[str]]:
    """Return what is known -> the columns that hold it, of those that a header has."""
    by_name = {name.strip().casefold(): name for name in header}
    found = {kind: [by_name[name] for name in names if name in by_name] for kind, names in COLUMNS.items()}
    return {kind: names for kind, names in found.items() if names}


def _text(path: Path) -> str:
    try:
        with path.open("rb") as file:
            data = file.read(MAX_BYTES + 1)
    except OSError as error:
        raise ClassError(f"{path}: expected a CSV file, found none that can be read: {error.strerror}") from None
    if len(data) > MAX_BYTES:
        raise ClassError(f"{path}: expected at most {MAX_BYTES >> 20} MiB, found more")
    encoding = "utf-16" if data[:2] in (b"\xff\xfe", b"\xfe\xff") else "utf-8-sig"
    try:
        return data.decode(encoding)
    except UnicodeDecodeError:
        raise ClassError(f"{path}: expected UTF-8, found another encoding", "save the file as CSV UTF-8") from None


def _is_noperson_of(row: Mapping[str, str]) -> bool:
    """Return whether a row of a Canvas gradebook is about points, or its made-up student."""
    first = next(iter(row.values())).strip().casefold()
    return first in ("points possible", "student, test", "test student")


def person_of(row: Mapping[str, str], columns: Mapping[str, Sequence[str]]) -> Person:
    """Return somebody of whom a row of a table tells."""

    def value(kind: str) -> str:
        return next((row[name].strip() for name in columns.get(kind, ()) if row[name].strip()), "")

    exact = [row[name] for kind in _EXACT for name in columns.get(kind, ()) if row[name].strip()]
    numbers = [match[1] for text in exact if (match := _PARTICIPANT.fullmatch(text.strip()))]
    first, last = value("first"), value("last")
    name = f"{first} {last}".strip() or _in_reading_order(value("name"))
    return Person(
        name=name or value("identifier") or next(iter(exact), "").strip(),
        user=value("user"),
        email=value("email"),
        id=value("id"),
        handles=frozenset(map(fold_handle, [*exact, *numbers])),
        names=frozenset(_spellings(name)),
        row=row,
    )


def _in_reading_order(name: str) -> str:
    last, comma, first = name.partition(",")
    return f"{first.strip()} {last.strip()}" if comma else name


def _spellings(name: str) -> Iterator[str]:
    """Yield a name as platforms put it together: first name first, and last name first."""
    words = name.split()
    for cut in range(len(words)):
        folded = fold_name("".join(words[cut:] + words[:cut]))
        if folded:
            yield folded


@dataclass(frozen=True, slots=True)
class RosterMatch:
    """What the roster says of the submissions.

    Attributes:
        people: Name of an entry -> the person, for those that are clear.
        unmatched: Names of entries that nobody on the roster goes with.
        ambiguous: Names of entries that several people go with.
        duplicates: Names of entries, in groups, that are of the same person.
        missing: People without a submission.
    """

    people: Mapping[str, Person] = field(default_factory=dict)
    unmatched: tuple[str, ...] = ()
    ambiguous: tuple[str, ...] = ()
    duplicates: tuple[tuple[str, ...], ...] = ()
    missing: tuple[Person, ...] = ()


def match(entries: Sequence[HandedInEntry], roster: Sequence[Person] | None) -> RosterMatch:
    """Return who handed in what.

    What identifies without doubt (user name, number, address, the folder's name) goes before names, and nobody is
    chosen where several could be meant.

    Args:
        entries: The submissions.
        roster: The people; None if there is no roster, then everybody goes by what the submission is called.
    """
    if roster is None:
        people = {entry.name: _unknown(entry) for entry in entries}
        return RosterMatch(people, duplicates=_twice(entries))
    found: dict[str, list[int]] = {entry.name: _candidates(entry, roster) for entry in entries}
    clear = {name: people[0] for name, people in found.items() if len(people) == 1}
    several: dict[int, list[str]] = {}
    for name, index in clear.items():
        several.setdefault(index, []).append(name)
    possible = {index for people in found.values() for index in people}
    return RosterMatch(
        people={name: roster[index] for name, index in clear.items()},
        unmatched=tuple(name for name, people in found.items() if not people),
        ambiguous=tuple(name for name, people in found.items() if len(people) > 1),
        duplicates=tuple(tuple(names) for names in several.values() if len(names) > 1),
        missing=tuple(person for index, person in enumerate(roster) if index not in possible),
    )


def _unknown(entry: HandedInEntry) -> Person:
    """Return a person of whom only the submission tells."""
    identity = entry.identity
    name = identity.get("name") or identity.get("user") or identity.get("email") or entry.label
    names = frozenset({fold_name(name)} - {""})
    return Person(name, identity.get("user", ""), identity.get("email", ""), identity.get("id", ""), names=names)


def _twice(entries: Sequence[HandedInEntry]) -> tuple[tuple[str, ...], ...]:
    """Return the entries of the same student: of one identity, or of one name as a folder and as an archive."""
    by_student: dict[tuple[str, ...], list[str]] = {}
    for entry in entries:
        who = [f"{kind}={fold_handle(text)}" for kind, text in sorted(entry.identity.items())]
        by_student.setdefault(tuple(who) or (fold_handle(entry.label),), []).append(entry.name)
    return tuple(tuple(names) for names in by_student.values() if len(names) > 1)


def _candidates(entry: HandedInEntry, roster: Sequence[Person]) -> list[int]:
    """Return the people that an entry may be of, by the surest sign that says anything."""
    exact = {fold_handle(text) for kind, text in entry.identity.items() if kind != "name"} | {fold_handle(entry.label)}
    found = [index for index, person in enumerate(roster) if person.handles & exact]
    if found:
        return found
    names = {fold_name(entry.identity.get("name", entry.label))} - {""}
    found = [index for index, person in enumerate(roster) if person.names & names]
    return found or _by_ending(entry, roster)


def _by_ending(entry: HandedInEntry, roster: Sequence[Person]) -> list[int]:
    """Return the people whose user name a clone's name ends with; of several such names the longest counts."""
    label = fold_handle(entry.label)
    lengths = {
        index: len(person.user)
        for index, person in enumerate(roster)
        if person.user and label.endswith(f"-{fold_handle(person.user)}")
    }
    longest = max(lengths.values(), default=0)
    return [index for index, length in lengths.items() if length == longest]
