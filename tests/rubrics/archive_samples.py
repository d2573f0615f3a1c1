"""Builds archives for tests, honest and hostile, with the standard library."""

from __future__ import annotations

import io
import stat
import tarfile
import zipfile
from collections.abc import Mapping, Sequence
from typing import Any


def zipped(
    files: Mapping[str, bytes] | Sequence[tuple[str, bytes]],
    compression: int = zipfile.ZIP_DEFLATED,
    modes: Mapping[str, int] | None = None,
) -> bytes:
    """Return a zip of name -> content; a name that ends in `/` is a folder; `modes` gives a Unix mode by name."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", compression) as archive:
        for name, content in files.items() if isinstance(files, Mapping) else files:
            info = zipfile.ZipInfo("x")
            info.filename = name  # the constructor would fix some names
            info.compress_type = compression
            info.external_attr = (modes or {}).get(name, stat.S_IFREG | 0o644) << 16
            archive.writestr(info, content)
    return buffer.getvalue()


def tarred(
    files: Mapping[str, bytes] | Sequence[tuple[str, bytes]],
    compression: str = "",
    types: Mapping[str, bytes] | None = None,
    format_: int = tarfile.PAX_FORMAT,
) -> bytes:
    """Return a tar of name -> content, `compression` as in `tarfile.open`; `types` gives a type by name."""
    buffer = io.BytesIO()
    mode: Any = f"w:{compression}"
    with tarfile.open(fileobj=buffer, mode=mode, format=format_, errors="surrogateescape") as archive:
        for name, content in files.items() if isinstance(files, Mapping) else files:
            info = tarfile.TarInfo(name)
            info.type = (types or {}).get(name, tarfile.REGTYPE)
            if info.type in (tarfile.LNKTYPE, tarfile.SYMTYPE):
                info.linkname = content.decode()
            info.size = len(content) if info.isreg() else 0
            archive.addfile(info, io.BytesIO(content))
    return buffer.getvalue()
