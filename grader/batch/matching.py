"""Who handed in what: submissions matched to the people of a roster, and everybody for whom that is not clear."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from grader.batch.intake import Entry
from grader.batch.people import Person, fold_handle, fold_name


@dataclass(frozen=True, slots=True)
class Matching:
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


def match(entries: Sequence[Entry], roster: Sequence[Person] | None) -> Matching:
    """Return who handed in what.

    What identifies without doubt (user name, number, address, the folder's name) goes before names, and nobody is
    chosen where several could be meant.

    Args:
        entries: The submissions.
        roster: The people; None if there is no roster, then everybody goes by what the submission is called.
    """
    if roster is None:
        people = {entry.name: _unknown(entry) for entry in entries}
        return Matching(people, duplicates=_twice(entries))
    found: dict[str, list[int]] = {entry.name: _candidates(entry, roster) for entry in entries}
    clear = {name: people[0] for name, people in found.items() if len(people) == 1}
    several: dict[int, list[str]] = {}
    for name, index in clear.items():
        several.setdefault(index, []).append(name)
    possible = {index for people in found.values() for index in people}
    return Matching(
        people={name: roster[index] for name, index in clear.items()},
        unmatched=tuple(name for name, people in found.items() if not people),
        ambiguous=tuple(name for name, people in found.items() if len(people) > 1),
        duplicates=tuple(tuple(names) for names in several.values() if len(names) > 1),
        missing=tuple(person for index, person in enumerate(roster) if index not in possible),
    )


def _unknown(entry: Entry) -> Person:
    """Return a person of whom only the submission tells."""
    identity = entry.identity
    name = identity.get("name") or identity.get("user") or identity.get("email") or entry.label
    names = frozenset({fold_name(name)} - {""})
    return Person(name, identity.get("user", ""), identity.get("email", ""), identity.get("id", ""), names=names)


def _twice(entries: Sequence[Entry]) -> tuple[tuple[str, ...], ...]:
    """Return the entries of the same student: of one identity, or of one name as a folder and as an archive."""
    by_student: dict[tuple[str, ...], list[str]] = {}
    for entry in entries:
        who = [f"{kind}={fold_handle(text)}" for kind, text in sorted(entry.identity.items())]
        by_student.setdefault(tuple(who) or (fold_handle(entry.label),), []).append(entry.name)
    return tuple(tuple(names) for names in by_student.values() if len(names) > 1)


def _candidates(entry: Entry, roster: Sequence[Person]) -> list[int]:
    """Return the people that an entry may be of, by the surest sign that says anything."""
    exact = {fold_handle(text) for kind, text in entry.identity.items() if kind != "name"} | {fold_handle(entry.label)}
    found = [index for index, person in enumerate(roster) if person.handles & exact]
    if found:
        return found
    names = {fold_name(entry.identity.get("name", entry.label))} - {""}
    found = [index for index, person in enumerate(roster) if person.names & names]
    return found or _by_ending(entry, roster)


def _by_ending(entry: Entry, roster: Sequence[Person]) -> list[int]:
    """Return the people whose user name a clone's name ends with; of several such names the longest counts."""
    label = fold_handle(entry.label)
    lengths = {
        index: len(person.user)
        for index, person in enumerate(roster)
        if person.user and label.endswith(f"-{fold_handle(person.user)}")
    }
    longest = max(lengths.values(), default=0)
    return [index for index, length in lengths.items() if length == longest]
