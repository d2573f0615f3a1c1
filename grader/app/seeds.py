"""Seeds: the number that all drawn values follow from, and the keys that it is made of."""

from __future__ import annotations

import hashlib
import hmac
import os
import secrets
import stat
import unicodedata
from collections.abc import MutableMapping
from dataclasses import dataclass, field
from pathlib import Path

from grader.core.errors import KeyFileError, VariantError
from grader.core.exercise import Drawn, Exercise, Value
from grader.rubrics.loader import read_rubric
from grader.rubrics.variants import VariantOptions
from grader.submissions.collected import shown

#: Fewest and most bytes of a key; one that could be guessed would tell students what is drawn.
LEAST_BYTES, MOST_BYTES = 16, 4096


def read_key(path: Path, what: str) -> bytes:
    """Return the key in a file, without the blanks around it.

    Args:
        path: The file.
        what: What messages call the key, such as `course key`.

    Raises:
        KeyFileError: It cannot be used.
    """
    where = shown(str(path), 500)
    try:
        with path.open("rb") as file:
            key = file.read(MOST_BYTES + 1).strip()
    except OSError as error:
        raise KeyFileError(f"{where}: expected a file with the {what}: {error.strerror}") from None
    return checked_key(key, where)


def checked_key(key: bytes, where: str) -> bytes:
    """Return a key; raises KeyFileError for one that is too short or too long, without a word of what is in it."""
    if not LEAST_BYTES <= len(key) <= MOST_BYTES:
        found = f"more than {MOST_BYTES}" if len(key) > MOST_BYTES else str(len(key))
        hint = "make one: head -c 32 /dev/urandom | base64 > course.key"
        raise KeyFileError(f"{where}: expected a key of {LEAST_BYTES} to {MOST_BYTES} bytes, found {found}", hint)
    return key


#: Holds the seed key itself, for a CI that keeps it as a secret.
VARIABLE = "GRADER_SEED_KEY"
#: What reports say where anybody can work out the seed.
PRACTICE_NOTE = "drawn values follow from the public practice key; --seed-key FILE draws values that nobody can predict"
_SCHEME = b"grader/seed/v1\n"
#: 48 bits: exact in every JSON reader, short enough to type, and too many to try in a student's process.
_HEX_DIGITS = 12
_KEY_BYTES = 32


@dataclass(frozen=True, slots=True)
class SeedKey:
    """The key that seeds are made with; its value is in no text that is made of this object.

    Attributes:
        value: The key.
        public: Whether everybody knows it.
    """

    value: bytes = field(repr=False)
    public: bool = False

    def seed(self, digest: str) -> int:
        """Return the seed of a submission by its digest.

        It belongs to this digest alone: who knows it can repeat the run, but learns nothing about the seed of another
        submission, nor of the same one after any change. So reports may show it to students.
        """
        return int(hmac.new(self.value, _SCHEME + digest.encode(), hashlib.sha256).hexdigest()[:_HEX_DIGITS], 16)


#: The key of a student's own runs, and of any run without another key.
PRACTICE = SeedKey(b"rclpy-grader: the public practice key, for runs that nobody is marked by", public=True)


def seed_key(path: Path | None, environment: MutableMapping[str, str] = os.environ) -> SeedKey | None:
    """Return the key that a run was given; None if it was given none.

    The variable is taken out of the environment, so that no process started later has it.

    Args:
        path: What `--seed-key` names; None if it was not given.
        environment: Where `GRADER_SEED_KEY` may stand; empty counts as unset, for that is what a CI without the
            secret makes of it.

    Raises:
        KeyFileError: The key cannot be used.
    """
    given = environment.pop(VARIABLE, "").strip()
    if path is not None:
        return SeedKey(read_key(path, "seed key"))
    return SeedKey(checked_key(given.encode("utf-8", "surrogateescape"), VARIABLE)) if given else None


def kept_key(path: Path) -> SeedKey:
    """Return the key in a file that only its owner can read; the first call makes it.

    Raises:
        KeyFileError: It cannot be read or made.
    """
    try:
        made = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC | os.O_NOFOLLOW, 0o600)
    except FileExistsError:
        _close_to_others(path)
        return SeedKey(read_key(path, "seed key"))
    except OSError as error:
        raise KeyFileError(f"{path}: the seed key cannot be written: {error.strerror}") from None
    with os.fdopen(made, "wb") as file:
        file.write(secrets.token_urlsafe(_KEY_BYTES).encode() + b"\n")
        file.flush()
        os.fsync(made)
    return SeedKey(read_key(path, "seed key"))


def _close_to_others(path: Path) -> None:
    """Take a key away from everybody but its owner: copying a folder may have opened it."""
    try:
        found = path.lstat()
        if not stat.S_ISREG(found.st_mode):
            raise KeyFileError(f"{path}: expected a file with the seed key, found something that is no plain file")
        if stat.S_IMODE(found.st_mode) & 0o077:
            path.chmod(0o600)
    except OSError as error:
        raise KeyFileError(f"{path}: expected a seed key that only you can read: {error.strerror}") from None


#: Longest id of a student.
MOST_ID = 200
_SCHEME = "grader/variant/v1"
_TAKEN_BYTES = 16


@dataclass(frozen=True, slots=True)
class ByKey:
    """Draws from a course key.

    Attributes:
        key: The key.
        student: Whose values are drawn; case, surrounding blanks and ways to encode a letter make no difference.
    """

    key: bytes
    student: str

    def value(self, exercise: str, options: VariantOptions) -> Value | None:
        """Return the value that HMAC-SHA256 picks for exercise, variant and student."""
        text = "\n".join((_SCHEME, exercise, options.name, folded(self.student)))
        digest = hmac.new(self.key, text.encode(), hashlib.sha256).digest()
        # 128 bits make the first values likelier than the last by no more than one in 2 to the 114.
        return options.value(int.from_bytes(digest[:_TAKEN_BYTES], "big") % options.count)


def folded(student: str) -> str:
    """Return the id of a student so that it is always written in one way."""
    return unicodedata.normalize("NFKC", student).strip().casefold()


def by_key(path: Path, student: str) -> ByKey:
    """Return what draws a student's values; raises GraderError for a key or an id that cannot be used."""
    return ByKey(read_key(path, "course key"), checked(student))


def checked(student: str) -> str:
    """Return the id of a student without blanks around it; raises VariantError for one that is none."""
    plain = student.strip()
    if not folded(plain) or len(plain) > MOST_ID or not plain.isprintable():
        text = f"expected the id of a student, up to {MOST_ID} signs on one line, found `{shown(student)}`"
        raise VariantError(f"--student: {text}")
    return plain


def sheet(path: Path, key: Path, student: str) -> Exercise:
    """Return the exercise of a rubric as one student has it; raises GraderError for what cannot be used."""
    return read_rubric(path, draw=by_key(key, student))


def drawn(exercises: list[Exercise], student: str) -> Drawn | None:
    """Return the values that exercises were read with; None if nothing in them varies."""
    values = {e.id: dict(e.variant.values) for e in exercises if e.variant is not None}
    return Drawn(student, values) if values else None
