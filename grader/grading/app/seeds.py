"""Keys, and what is derived from them: the seed of a run, and the variant of a student."""

from __future__ import annotations

import hashlib
import hmac
import os
import secrets
import stat
import unicodedata
from collections.abc import MutableMapping
from dataclasses import field
from pathlib import Path
from typing import TYPE_CHECKING

from grader.grading.model.exercise import Drawn, Exercise, Value
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.errors import KeyFileError, VariantError
from grader.runtime.model.wording import printable

if TYPE_CHECKING:
    from grader.grading.rubrics.draws import Options

#: Fewest and most bytes of a key; with a key that can be guessed, students could predict the drawn values.
LEAST_BYTES, MOST_BYTES = 16, 4096
#: Environment variable with the seed key itself, for a CI that stores it as a secret.
VARIABLE = "GRADER_SEED_KEY"
#: Shown in reports when anyone can compute the seed.
PRACTICE_NOTE = "the inputs were drawn with the public practice key; with --seed-key FILE, nobody can predict them"
#: Most characters in the id of a student.
MOST_ID = 200
_SEED_SCHEME = b"grader/seed/v1\n"
_VARIANT_SCHEME = "grader/variant/v1"
#: 48 bits: exact in every JSON reader, short enough to type, and too many to try in a student's process.
_HEX_DIGITS = 12
#: How many random bytes a new key is made from: 256 bits, as many as the hash has that it goes into.
_KEY_BYTES = 32
#: So many bytes of a hash choose a value of a variant: a remainder of 128 bits favours none of them noticeably.
_VARIANT_BYTES = 16


def read_key(path: Path, what: str) -> bytes:
    """Read a key from a file, and strip whitespace; a KeyFileError calls it `what`, such as `variant key`."""
    where = printable(str(path), 500)
    try:
        with path.open("rb") as file:
            key = file.read(MOST_BYTES + 1).strip()
    except OSError as error:
        raise KeyFileError(f"{where}: expected a file with the {what}: {error.strerror}") from None
    return checked_key(key, where)


def checked_key(key: bytes, where: str) -> bytes:
    """Check the length of a key; the message of the KeyFileError reveals nothing else about it."""
    if not LEAST_BYTES <= len(key) <= MOST_BYTES:
        found = f"more than {MOST_BYTES}" if len(key) > MOST_BYTES else str(len(key))
        hint = "make one: head -c 32 /dev/urandom | base64 > secret.key"
        raise KeyFileError(f"{where}: expected a key of {LEAST_BYTES} to {MOST_BYTES} bytes, found {found}", hint)
    return key


@dataclass(frozen=True, slots=True)
class SeedKey:
    """The key that seeds are derived from; the repr of this object does not reveal it."""

    value: bytes = field(repr=False)
    public: bool = False  # whether the key is publicly known

    def seed(self, digest: str) -> int:
        """Derive the seed of a submission from its digest.

        The seed allows students to repeat the run, but reveals nothing about the seed of another submission, or of the
        same one after a change. So reports may show it.
        """
        return int(hmac.new(self.value, _SEED_SCHEME + digest.encode(), hashlib.sha256).hexdigest()[:_HEX_DIGITS], 16)


#: The key of students' own runs, and of any run without another key.
PRACTICE = SeedKey(b"rclpy-grader: the public practice key, for runs that nobody is marked by", public=True)


def seed_key(path: Path | None, environment: MutableMapping[str, str] = os.environ) -> SeedKey | None:
    """Return the seed key from a file or the environment variable GRADER_SEED_KEY; None if neither has one.

    Removes the variable from the environment, so that no process started later inherits it. An empty value counts as
    unset, because CI systems set it if the secret does not exist.
    """
    given = environment.pop(VARIABLE, "").strip()
    if path is not None:
        return SeedKey(read_key(path, "seed key"))
    return SeedKey(checked_key(given.encode("utf-8", "surrogateescape"), VARIABLE)) if given else None


def kept_key(path: Path) -> SeedKey:
    """Return the key in a file that only its owner can read; create it on the first call."""
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
    """Restrict a key to its owner: copying the folder may have made it readable for others."""
    try:
        found = path.lstat()
        if not stat.S_ISREG(found.st_mode):
            raise KeyFileError(f"{path}: expected a file with the seed key, found something that is not a regular file")
        if stat.S_IMODE(found.st_mode) & 0o077:
            path.chmod(0o600)
    except OSError as error:
        raise KeyFileError(f"{path}: expected a seed key that only you can read: {error.strerror}") from None


@dataclass(frozen=True, slots=True)
class ByKey:
    """Draws the variant of a student from the variant key."""

    key: bytes
    student: str  # id of the student; case, surrounding whitespace and Unicode normalisation make no difference

    def value(self, exercise: str, options: Options) -> Value | None:
        """Pick a value by the HMAC-SHA256 of exercise, variant and student."""
        text = "\n".join((_VARIANT_SCHEME, exercise, options.name, folded(self.student)))
        digest = hmac.new(self.key, text.encode(), hashlib.sha256).digest()
        # With 128 bits, the bias of the modulo towards the first values is at most 2**-114.
        return options.value(int.from_bytes(digest[:_VARIANT_BYTES], "big") % options.count)


def folded(student: str) -> str:
    """Normalise the id of a student, so that different spellings of one id compare equal."""
    return unicodedata.normalize("NFKC", student).strip().casefold()


def by_key(path: Path, student: str) -> ByKey:
    """Read the variant key for a student; raises GraderError if the key or the id cannot be used."""
    return ByKey(read_key(path, "variant key"), checked_student(student))


def checked_student(student: str) -> str:
    """Strip whitespace from the id of a student; raises VariantError if the id cannot be used."""
    plain = student.strip()
    if not folded(plain) or len(plain) > MOST_ID or not plain.isprintable():
        text = f"expected the id of a student, up to {MOST_ID} characters on one line, found `{printable(student)}`"
        raise VariantError(f"--student: {text}")
    return plain


def drawn_values(exercises: list[Exercise], student: str) -> Drawn | None:
    """Return the variant values of the exercises; None if they have no variants."""
    values = {e.id: dict(e.variant.values) for e in exercises if e.variant is not None}
    return Drawn(student, values) if values else None
