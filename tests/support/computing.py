"""Code for programs that compute for a given time."""

from __future__ import annotations

import hashlib
import time

#: Iterations whose time is measured; they take 20 to 60 ms.
TRIED = 100_000


def library_call(seconds: float) -> str:
    """Return code that computes in a library for about so long, however fast this machine is."""
    started = time.process_time()
    hashlib.pbkdf2_hmac("sha256", b"x", b"y", TRIED)
    iterations = round(TRIED * seconds / (time.process_time() - started))
    return f"import hashlib\nhashlib.pbkdf2_hmac('sha256', b'x', b'y', {iterations})"
