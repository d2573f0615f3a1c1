"""Reads the roster of a class from the CSV export of any platform, and matches submissions to people."""

from __future__ import annotations

import csv
import io
import math
import re
import unicodedata
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import field
from fractions import Fraction
from pathlib import Path

from grader.course.classroom.downloads import CANVAS, CLASSROOM50, GITHUB, MOODLE
from grader.course.classroom.intake import HandedInEntry
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.errors import ClassError
from grader.runtime.model.wording import listed, printable

#: Largest CSV file that is read, and most rows.
MAX_BYTES = 8 << 20
MAX_ROWS = 20_000

#: Content of a column -> its names on platforms, in lower case.
COLUMNS: Mapping[str, tuple[str, ...]] = {
    "name": ("name", "student", "student name", "full name", "fullname"),
    "first": ("first name", "first_name", "firstname", "given name", "given_name"),
    "last": ("last name", "last_name", "lastname", "surname", "family name", "family_name"),
    "user": ("username", "user", "login", "sis login id", "login id"),
    "github": ("github_username", "github username"),
    "email": ("email address", "email", "e-mail", "e-mail address"),
    "id": ("id number", "idnumber", "sis user id", "student id", "student_id", "student number", "sid"),
    "canvas": ("id",),
    "identifier": ("identifier",),
    "folder": ("folder", "submission", "directory"),
}
#: Contents that identify a person uniquely. Each is compared with the same content alone: a participant number of
#: Moodle may be the ID number of somebody else.
_EXACT = ("folder", "user", "github", "email", "id", "canvas", "number", "identifier")
#: Ids that one institution gives: two people of one name who differ in one of them are not the same person. A user name
#: or an address may differ for one person, on two platforms.
_INSTITUTIONAL = ("id", "canvas")
#: Columns beside which `ID` is the number of an account in Canvas. Elsewhere it may be any number, and counts as both.
_OF_CANVAS = frozenset({"sis user id", "sis login id", "section"})
#: Group of a pattern -> the contents of columns that may hold it.
_HELD_BY: Mapping[str, tuple[str, ...]] = {
    "user": ("user", "github"),
    "email": ("email", "identifier"),
    "id": ("id", "canvas", "number", "identifier"),
}
#: The same for the layouts of platforms, whose names tell more.
_HELD_BY_IN: Mapping[str, Mapping[str, tuple[str, ...]]] = {
    MOODLE: {"id": ("identifier",)},
    CANVAS: {"id": ("canvas", "number")},
}
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
    # Content of a column -> the ids in it that are unique to this person, normalised by `fold_handle`
    ids: Mapping[str, frozenset[str]] = field(default_factory=dict)
    names: frozenset[str] = frozenset()  # spellings of the name, without spaces and accents
    row: Mapping[str, str] | None = None  # column -> value on the roster; None for a person who is not on a roster
    canvas: str = ""  # number of the account in Canvas; empty if the roster has none
    surname: str = ""  # as the roster has it; empty if it does not tell the surname

    @property
    def handles(self) -> frozenset[str]:
        """All ids that are unique to this person, whatever they are."""
        return frozenset[str]().union(*self.ids.values())

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
    people: Sequence[Person]  # who each row is about; without ids and names if no column identifies people


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
    values = [dict(zip(header, [*row, *[""] * len(header)], strict=False)) for row in rows[1:]]
    columns = columns_of(header)
    return Table(path, header, values, [person_of(row, columns) for row in values])


def read_roster(path: Path) -> list[Person]:
    """Read the people of a roster: a CSV export from Canvas, Moodle, GitHub or Classroom 50, or a custom one.

    Raises ClassError if the file cannot be read, or no column identifies people.
    """
    table = read_table(path)
    columns = columns_of(table.header)
    if not columns:
        known = listed([names[0] for names in COLUMNS.values()])
        found = listed([printable(name, 30) for name in table.header[:6]], "and")
        raise ClassError(f"{path}:1: expected a column {known}, found {found}", "name the columns in the first line")
    return [person for person in table.people if person.name and not _is_no_person(person.row or {})]


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

    exact = {kind: [row[name] for name in columns.get(kind, ()) if row[name].strip()] for kind in _EXACT}
    exact["identifier"] += [match[1] for text in exact["identifier"] if (match := _PARTICIPANT.fullmatch(text.strip()))]
    of_canvas = not _OF_CANVAS.isdisjoint(name.strip().casefold() for name in row)
    if not of_canvas:
        exact["number"] = exact.pop("canvas")
    first, last = value("first"), value("last")
    name = f"{first} {last}".strip() or _in_reading_order(value("name"))
    before, comma, _ = value("name").partition(",")
    return Person(
        surname=last or (before.strip() if comma else ""),
        name=name or value("identifier") or next((text.strip() for texts in exact.values() for text in texts), ""),
        user=value("user") or value("github"),
        email=value("email"),
        id=value("id") or ("" if of_canvas else value("canvas")),
        canvas=value("canvas") if of_canvas else "",
        ids={kind: frozenset(map(fold_handle, texts)) for kind, texts in exact.items() if texts},
        names=frozenset(spellings(name)),
        row=row,
    )


def row_of(person: Person | None, table: Table | None) -> Mapping[str, str] | None:
    """Find the row of a person in a table by unique ids, then by name; None unless exactly one row matches.

    Somebody of the same name with another number is another person.
    """
    if person is None or table is None:
        return None
    found = [other for other in table.people if _share_an_id(person, other)]
    if not found:
        namesakes = (other for other in table.people if other.names & person.names)
        found = [other for other in namesakes if not _differ(person.ids, other.ids, _INSTITUTIONAL)]
    return found[0].row if len(found) == 1 else None


def _share_an_id(one: Person, other: Person) -> bool:
    """Whether two people have an id of the same kind in common; an address is one wherever it stands."""
    same = any(one.ids[kind] & other.ids[kind] for kind in one.ids.keys() & other.ids.keys() if kind != "folder")
    return (
        same
        or _by_number(one, other)
        or _by_number(other, one)
        or any("@" in id_ for id_ in one.handles & other.handles)
    )


def _by_number(one: Person, other: Person) -> bool:
    numbers = one.ids.get("number", frozenset[str]())
    return any(numbers & other.ids.get(kind, frozenset[str]()) for kind in _INSTITUTIONAL)


def _differ(one: Mapping[str, frozenset[str]], other: Mapping[str, frozenset[str]], kinds: Iterable[str]) -> bool:
    """Whether both have ids of one of the kinds, and none in common."""
    return any(kind in one and kind in other and not one[kind] & other[kind] for kind in kinds)


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

    Unique ids (user name, number, email address, folder) take precedence over names, and each is compared with ids of
    its kind. If several people match, none is chosen. Without a roster, people are named after their submissions.
    """
    if roster is None:
        people = {entry.name: _unknown(entry) for entry in entries}
        return RosterMatch(people, duplicates=_twice(entries))
    found = _candidates(entries, roster)
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
    ids = {kinds[0]: frozenset({text}) for kinds, text in _told(entry)}
    number = identity.get("id", "")
    return Person(
        name=name,
        user=identity.get("user", ""),
        email=identity.get("email", ""),
        # A platform's own number for a participant or an account is not the number at the institution.
        id="" if entry.layout in _HELD_BY_IN else number,
        canvas=number if entry.layout == CANVAS else "",
        ids=ids,
        names=names,
    )


def _twice(entries: Sequence[HandedInEntry]) -> tuple[tuple[str, ...], ...]:
    """Group entries by the same student: of the same identity, or of the same name as a folder and as an archive."""
    by_student: dict[tuple[str, ...], list[str]] = {}
    for entry in entries:
        who = [f"{kind}={fold_handle(text)}" for kind, text in sorted(entry.identity.items())]
        by_student.setdefault(tuple(who) or (fold_handle(entry.label),), []).append(entry.name)
    return tuple(tuple(names) for names in by_student.values() if len(names) > 1)


def _candidates(entries: Sequence[HandedInEntry], roster: Sequence[Person]) -> dict[str, list[int]]:
    """Return name of an entry -> the indices of the people who match it by the most reliable criterion that does."""
    exact = {entry.name: [i for i, person in enumerate(roster) if _is_exactly(entry, person)] for entry in entries}
    # Names of columns do not tell whether their ids are those of this download; that somebody matches does.
    shared = {
        kind
        for entry in entries
        for index in exact[entry.name]
        for kinds, text in _told(entry)
        for kind in kinds
        if text in roster[index].ids.get(kind, ())
    }
    clones = _clones(entries, roster)
    return {e.name: exact[e.name] or _named(e, roster, shared) or clones.get(e.name, []) for e in entries}


def _told(entry: HandedInEntry) -> Iterator[tuple[tuple[str, ...], str]]:
    """Yield each unique id in the name of a submission, normalised, with the contents of columns that may hold it."""
    held_by = {**_HELD_BY, **_HELD_BY_IN.get(entry.layout, {})}
    for group, text in entry.identity.items():
        if group in held_by:
            yield held_by[group], fold_handle(text)


def _is_exactly(entry: HandedInEntry, person: Person) -> bool:
    """Whether a unique id matches: one that the name tells, or else whatever the whole name may be."""
    label = fold_handle(entry.label)
    if not entry.identity:
        return label in person.handles
    if label in person.ids.get("folder", ()):
        return True
    return any(text in ids for kinds, text in _told(entry) for ids in _held(entry, person, kinds))


def _held(entry: HandedInEntry, person: Person, kinds: Sequence[str]) -> Iterator[frozenset[str]]:
    """Yield the ids of a person that may be meant: at GitHub, its user name and no other, if the roster has it."""
    if entry.layout in (GITHUB, CLASSROOM50) and "github" in person.ids:
        kinds = ["github"]
    yield from (person.ids[kind] for kind in kinds if kind in person.ids)


def _named(entry: HandedInEntry, roster: Sequence[Person], shared: Collection[str]) -> list[int]:
    """Return the people of the name, but for those who have another id of a kind by which this class is matched."""
    name = entry.identity.get("name", "") if entry.identity else entry.label
    names = {fold_name(name)} - {""}
    told: dict[str, frozenset[str]] = {}
    for kinds, text in _told(entry):
        told |= {kind: told.get(kind, frozenset()) | {text} for kind in kinds}
    return [i for i, p in enumerate(roster) if p.names & names and not _differ(told, p.ids, shared)]


def _clones(entries: Sequence[HandedInEntry], roster: Sequence[Person]) -> dict[str, list[int]]:
    """Return name of an entry -> the people whose user name follows what the names of several clones begin with.

    `hw-mal-li` is not the clone of `li` where others begin with `hw-`: its user is called `mal-li`.
    """
    labels = {entry.name: fold_handle(entry.label) for entry in entries if "user" not in entry.identity}
    users = {i: p.ids.get("github", p.ids.get("user", frozenset[str]())) for i, p in enumerate(roster)}
    ends = {
        name: [(label[: -len(user)], i) for i, ids in users.items() for user in ids if label.endswith(f"-{user}")]
        for name, label in labels.items()
    }
    whole = [fold_handle(entry.label) for entry in entries]
    proposed = {prefix for found in ends.values() for prefix, _ in found}
    several = {prefix for prefix in proposed if sum(label.startswith(prefix) for label in whole) > 1}
    shortest = {p for p in several if not any(p != other and p.startswith(other) for other in several)}
    return {name: [index for prefix, index in found if prefix in shortest] for name, found in ends.items()}
