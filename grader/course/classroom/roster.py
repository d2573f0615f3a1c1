"""Reads the roster of a class from the CSV export of any platform, and matches submissions to people."""

from __future__ import annotations

import csv
import io
import math
import re
import unicodedata
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import field
from fractions import Fraction
from pathlib import Path

from grader.course.classroom.intake import HandedInEntry
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.errors import ClassError
from grader.runtime.model.wording import listed, shown

#: Largest CSV file that is read, and most rows.
MAX_BYTES = 8 << 20
MAX_ROWS = 20_000

#: Content of a column -> its names on platforms, in lower case.
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
#: Columns that identify a person uniquely.
_EXACT = ("folder", "user", "email", "id", "canvas", "identifier")
# Moodle's grading worksheet says `Submitted for grading - 1 day 3 hours late` in this column.
_STATUS = "status"
_LATE = re.compile(r"((?:\d+\s+[a-z]+\s+)+)late\b", re.IGNORECASE)
_HOURS: Mapping[str, int | Fraction] = {
    "year": 8760,
    "week": 168,
    "day": 24,
    "hour": 1,
    "min": Fraction(1, 60),
    "sec": Fraction(1, 3600),
}
# Moodle's grading worksheet writes `Participant 657693`, its download only the number.
_PARTICIPANT = re.compile(r"\D+ (\d+)")


@dataclass(frozen=True, slots=True)
class Person:
    """Somebody on the roster."""

    name: str  # name for display
    user: str = ""  # user name on the platform; empty if the roster has none
    email: str = ""  # email address; empty if the roster has none
    id: str = ""  # number at the institution; empty if the roster has none
    handles: frozenset[str] = frozenset()  # all ids that are unique to this person, normalised by `fold_handle`
    names: frozenset[str] = frozenset()  # spellings of the name, without spaces and accents
    row: Mapping[str, str] | None = None  # column -> value on the roster; None for a person who is not on a roster
    canvas: str = ""  # number of the account in Canvas; empty if the roster has none
    surname: str = ""  # as the roster has it; empty if it does not tell the surname

    @property
    def platform_ids(self) -> dict[str, str]:
        """The ids that platforms know the person by, without empty ones, the most reliable first."""
        ids = {"canvas": self.canvas, "id": self.id, "email": self.email, "username": self.user}
        return {kind: value for kind, value in ids.items() if value}

    @property
    def sort_key(self) -> tuple[str, str]:
        """Orders people by surname, then name; where the roster has no surname, it is the last word of the name."""
        last = self.surname or next(reversed(self.name.split()), "")
        return fold_name(last), fold_name(self.name)


def fold_handle(text: str) -> str:
    """Normalise a handle, so that different spellings compare equal."""
    return unicodedata.normalize("NFKC", text).strip().casefold()


def fold_name(text: str) -> str:
    """Reduce a name to letters and digits without accents, so that `Ada O'Möhr` and `adaomohr` compare equal."""
    plain = unicodedata.normalize("NFKD", text).casefold()
    return "".join(c for c in plain if c.isalnum())


@dataclass(frozen=True, slots=True)
class Table:
    """A table that a platform exported."""

    path: Path
    header: Sequence[str]
    rows: Sequence[Mapping[str, str]]  # column -> value


def read_table(path: Path) -> Table:
    """Read header and rows of a CSV file separated by commas, semicolons or tabs; raises ClassError if it has none."""
    text = _text(path)
    first = text.split("\n", 1)[0]
    delimiter = max(",;\t", key=first.count)
    try:
        rows = list(csv.reader(io.StringIO(text, newline=""), delimiter=delimiter))
    except csv.Error as error:
        raise ClassError(f"{path}: expected CSV, found another kind of file: {error}") from None
    rows = [row for row in rows if any(cell.strip() for cell in row)]
    if len(rows) < 2:
        raise ClassError(f"{path}: expected a header and rows, found {len(rows)} lines")
    if len(rows) > MAX_ROWS:
        raise ClassError(f"{path}: expected at most {MAX_ROWS} rows, found more")
    header = rows[0]
    return Table(path, header, [dict(zip(header, [*row, *[""] * len(header)], strict=False)) for row in rows[1:]])


def read_roster(path: Path) -> list[Person]:
    """Read the people of a roster: a CSV export from Canvas, Moodle, GitHub or Classroom 50, or a custom one.

    Raises ClassError if the file cannot be read, or no column identifies people.
    """
    table = read_table(path)
    columns = columns_of(table.header)
    if not columns:
        known = listed([names[0] for names in COLUMNS.values()])
        found = listed([shown(name, 30) for name in table.header[:6]], "and")
        raise ClassError(f"{path}:1: expected a column {known}, found {found}", "name the columns in the first line")
    return [person for row in table.rows if not _is_no_person(row) and (person := person_of(row, columns)).name]


def columns_of(header: Sequence[str]) -> dict[str, list[str]]:
    """Return content -> the columns of a header that hold it."""
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


def _is_no_person(row: Mapping[str, str]) -> bool:
    """Whether a row of a Canvas gradebook holds possible points or the test student."""
    first = next(iter(row.values())).strip().casefold()
    return first in ("points possible", "student, test", "test student")


def person_of(row: Mapping[str, str], columns: Mapping[str, Sequence[str]]) -> Person:
    """Build a person from a row of a table."""

    def value(kind: str) -> str:
        return next((row[name].strip() for name in columns.get(kind, ()) if row[name].strip()), "")

    exact = [row[name] for kind in _EXACT for name in columns.get(kind, ()) if row[name].strip()]
    numbers = [match[1] for text in exact if (match := _PARTICIPANT.fullmatch(text.strip()))]
    first, last = value("first"), value("last")
    name = f"{first} {last}".strip() or _in_reading_order(value("name"))
    before, comma, _ = value("name").partition(",")
    return Person(
        surname=last or (before.strip() if comma else ""),
        name=name or value("identifier") or next(iter(exact), "").strip(),
        user=value("user"),
        email=value("email"),
        id=value("id"),
        canvas=value("canvas"),
        handles=frozenset(map(fold_handle, [*exact, *numbers])),
        names=frozenset(spellings(name)),
        row=row,
    )


def row_of(person: Person | None, table: Table | None) -> Mapping[str, str] | None:
    """Find the row of a person in a table by unique ids, then by name; None unless exactly one row matches."""
    if person is None or table is None:
        return None
    columns = columns_of(table.header)
    handles = person.handles | {fold_handle(t) for t in (person.user, person.email, person.id) if t}
    exact = [name for kind in ("email", "user", "id", "canvas", "identifier") for name in columns.get(kind, ())]
    found = [r for r in table.rows if any(r[name].strip() and fold_handle(r[name]) in handles for name in exact)]
    if not found:
        found = [r for r in table.rows if person_of(r, columns).names & person.names]
    return found[0] if len(found) == 1 else None


def late_by(person: Person | None, worksheet: Table | None = None) -> str:
    """Return how late somebody handed in, as a grading worksheet of Moodle in English says; empty if it does not.

    The worksheet may be the roster, or a table of its own.
    """
    rows = [None if person is None else person.row, row_of(person, worksheet)]
    return next((late for row in rows if row is not None and (late := _late_in(row))), "")


def _late_in(row: Mapping[str, str]) -> str:
    status = next((value for name, value in row.items() if name.strip().casefold() == _STATUS), "")
    found = _LATE.search(status)
    return " ".join(found[1].split()) if found else ""


def late_days(text: str) -> str:
    """Return a time such as `1 day 3 hours` as a number of days, rounded up to hundredths; empty for any other text."""
    parts = re.findall(r"(\d+) ([a-z]+)", text.casefold())
    hours = [Fraction(count) * _HOURS[key] for count, unit in parts for key in _HOURS if unit.startswith(key)]
    if not hours or len(hours) < len(parts):
        return ""
    hundredths = math.ceil(sum(hours, Fraction(0)) * 100 / 24)
    return f"{hundredths / 100:g}"


def _in_reading_order(name: str) -> str:
    last, comma, first = name.partition(",")
    return f"{first.strip()} {last.strip()}" if comma else name


def spellings(name: str) -> Iterator[str]:
    """Yield all rotations of a name's words, because platforms order first and last names differently."""
    words = name.split()
    for cut in range(len(words)):
        folded = fold_name("".join(words[cut:] + words[:cut]))
        if folded:
            yield folded


@dataclass(frozen=True, slots=True)
class RosterMatch:
    """How submissions match the roster."""

    people: Mapping[str, Person] = field(default_factory=dict)  # name of an entry -> person, for unambiguous matches
    unmatched: tuple[str, ...] = ()  # names of entries that match nobody on the roster
    ambiguous: tuple[str, ...] = ()  # names of entries that match several people
    duplicates: tuple[tuple[str, ...], ...] = ()  # groups of names of entries by the same person
    missing: tuple[Person, ...] = ()  # people without a submission


def match(entries: Sequence[HandedInEntry], roster: Sequence[Person] | None) -> RosterMatch:
    """Match submissions to people.

    Unique ids (user name, number, email address, folder) take precedence over names. If several people match, none is
    chosen. Without a roster, people are named after their submissions.
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
    """Build a person from a submission alone."""
    identity = entry.identity
    name = identity.get("name") or identity.get("user") or identity.get("email") or entry.label
    names = frozenset({fold_name(name)} - {""})
    return Person(name, identity.get("user", ""), identity.get("email", ""), identity.get("id", ""), names=names)


def _twice(entries: Sequence[HandedInEntry]) -> tuple[tuple[str, ...], ...]:
    """Group entries by the same student: of the same identity, or of the same name as a folder and as an archive."""
    by_student: dict[tuple[str, ...], list[str]] = {}
    for entry in entries:
        who = [f"{kind}={fold_handle(text)}" for kind, text in sorted(entry.identity.items())]
        by_student.setdefault(tuple(who) or (fold_handle(entry.label),), []).append(entry.name)
    return tuple(tuple(names) for names in by_student.values() if len(names) > 1)


def _candidates(entry: HandedInEntry, roster: Sequence[Person]) -> list[int]:
    """Return the indices of the people that match an entry by the most reliable criterion that matches anyone."""
    exact = {fold_handle(text) for kind, text in entry.identity.items() if kind != "name"} | {fold_handle(entry.label)}
    found = [index for index, person in enumerate(roster) if person.handles & exact]
    if found:
        return found
    names = {fold_name(entry.identity.get("name", entry.label))} - {""}
    found = [index for index, person in enumerate(roster) if person.names & names]
    return found or _by_ending(entry, roster)


def _by_ending(entry: HandedInEntry, roster: Sequence[Person]) -> list[int]:
    """Return the people whose user name ends the name of a clone; the longest user name wins."""
    label = fold_handle(entry.label)
    lengths = {
        index: len(person.user)
        for index, person in enumerate(roster)
        if person.user and label.endswith(f"-{fold_handle(person.user)}")
    }
    longest = max(lengths.values(), default=0)
    return [index for index, length in lengths.items() if length == longest]
