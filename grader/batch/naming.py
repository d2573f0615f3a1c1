"""Names for results: safe in any path, readable, and the same whenever the same class is graded."""

from __future__ import annotations

import hashlib
import re
import unicodedata
from collections import Counter
from collections.abc import Sequence

#: Longest name, in bytes of UTF-8; room is left for a mark that tells two apart.
MAX_BYTES = 80
_RESERVED = re.compile(r"(con|prn|aux|nul|com\d|lpt\d)(\..*)?")
_KEPT = frozenset("._@+-")


def safe_name(text: str) -> str:
    """Return text as one part of a path on any system: letters, digits and `._@+-`, in lower case, never empty."""
    plain = unicodedata.normalize("NFKC", text).casefold()
    slug = "".join(c if c.isalnum() or c in _KEPT else "-" for c in unicodedata.normalize("NFC", plain))
    slug = re.sub(r"-{2,}", "-", slug).strip("-. ")
    slug = slug.encode("utf-8", "ignore")[:MAX_BYTES].decode("utf-8", "ignore").strip("-. ")
    if not slug or _RESERVED.fullmatch(slug):
        return f"{slug or 'unnamed'}-{_mark(text)}"
    return slug


def distinct_names(wishes: Sequence[tuple[str, str]]) -> list[str]:
    """Return one safe name for each wish, no two the same.

    A name does not depend on the order: all that wish for the same one get a mark that follows from what they are.

    Args:
        wishes: The name wished for, and what tells this one from all others, such as its path in the download.
    """
    names = [safe_name(wish) for wish, _ in wishes]
    count = Counter(names)
    return [name if count[name] == 1 else f"{name}-{_mark(own)}" for name, (_, own) in zip(names, wishes, strict=True)]


def _mark(text: str) -> str:
    return hashlib.sha256(text.encode("utf-8", "surrogatepass")).hexdigest()[:6]
