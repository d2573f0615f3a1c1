"""What both platforms need of the web: an address that keeps the token secret, the token itself, and time limits."""

from __future__ import annotations

import ipaddress
import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import requests
from requests.adapters import HTTPAdapter
from urllib3.util.retry import Retry

from grader.course.classroom.uploading.marks import PlatformError
from grader.runtime.model.errors import ClassError

#: Seconds to connect, and to wait for an answer.
TIMEOUT_S = (10.0, 60.0)
_MAX_TOKEN = 4096


class Patient(HTTPAdapter):
    """Waits a limited time for each answer; asks again for reads that failed in a way that may pass."""

    def __init__(self) -> None:
        again = (429, 502, 503, 504)
        reads = Retry(3, backoff_factor=0.5, status_forcelist=again, allowed_methods=("GET",), raise_on_status=False)
        super().__init__(max_retries=reads)

    def send(self, request: requests.PreparedRequest, *args: Any, **options: Any) -> requests.Response:
        """Send a request with the time limits, unless it has its own."""
        if options.get("timeout") is None:
            options["timeout"] = TIMEOUT_S
        return super().send(request, *args, **options)


def platform_address(text: str) -> str:
    """Return the address of a platform without a slash at its end; raises ClassError unless it is safe for a token."""
    parts = urlsplit(text.strip())
    if parts.scheme not in ("http", "https") or not parts.hostname or parts.query or parts.fragment or parts.username:
        raise ClassError(f"--url: expected an address such as https://canvas.example.edu, found {text[:80]!r}")
    if parts.scheme == "http" and not _is_here(parts.hostname):
        raise ClassError(
            f"--url: expected https, found {text[:80]!r}", "with http, anybody on the network can read the token"
        )
    return text.strip().rstrip("/")


def _is_here(host: str) -> bool:
    try:
        return host == "localhost" or ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def token_of(variable: str, file: Path | None) -> str:
    """Return the access token from a file, or else an environment variable; raises ClassError if there is none."""
    if file is None:
        token = os.environ.get(variable, "").strip()
        if not token:
            hint = f"create a token on the platform, then set {variable} or write it to a file for --token-file"
            raise ClassError(f"expected an access token in {variable}, found none", hint)
    else:
        try:
            token = file.read_bytes()[: _MAX_TOKEN + 1].decode("ascii").strip()
        except OSError as error:
            raise ClassError(f"{file}: expected an access token, found: {error.strerror}") from None
        except UnicodeDecodeError:
            token = ""
    if not token or len(token) > _MAX_TOKEN or not token.isprintable() or " " in token or not token.isascii():
        raise ClassError(f"{file or variable}: expected one access token and nothing else")
    return token


@contextmanager
def documented(url: str) -> Iterator[None]:
    """Turn what goes wrong when an answer is not of the documented form into a PlatformError."""
    try:
        yield
    except (KeyError, IndexError, TypeError, ValueError, AttributeError) as error:
        text = f"{url}: an answer that is not as documented: {type(error).__name__}: {error}"
        raise PlatformError(text[:300], "check --url") from None
