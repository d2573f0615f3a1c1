"""Builds archives for tests, honest and hostile, with the standard library."""

from __future__ import annotations

import base64
import io
import stat
import struct
import tarfile
import zipfile
import zlib
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


def sevened(
    files: Mapping[str, bytes] | Sequence[tuple[str, bytes]],
    compression: str = "lzma1",
) -> bytes:
    """Return a .7z of name -> content, written by libarchive."""
    import libarchive
    from libarchive.entry import FileType

    made: list[bytes] = []

    def write(data: bytes) -> int:
        made.append(bytes(data))
        return len(data)

    with libarchive.custom_writer(write, "7zip", options=f"compression={compression}") as archive:
        for name, content in files.items() if isinstance(files, Mapping) else files:
            kind = FileType.DIRECTORY if name.endswith("/") else FileType.REGULAR_FILE
            archive.add_file_from_memory(name, len(content), content, filetype=kind)
    return b"".join(made)


def rarred(files: Mapping[str, bytes] | Sequence[tuple[str, bytes]], links: Mapping[str, str] | None = None) -> bytes:
    """Return a RAR 5.0 archive that stores its files, after the public description of the format by its author."""
    blocks = [_rar_block(1, 0, _vint(0))]
    for name, content in files.items() if isinstance(files, Mapping) else files:
        blocks.append(_rar_file(name, content))
    for name, target in (links or {}).items():
        blocks.append(_rar_file(name, b"", rar_redirection(1, target)))
    return b"Rar!\x1a\x07\x01\x00" + b"".join([*blocks, _rar_block(5, 0, _vint(0))])


def rar_redirected(kind: int, *, size: int, before: bytes = b"") -> bytes:
    """Return a RAR 5.0 archive whose second file is a redirection of a kind to the first one, and is `size` bytes long.

    Another record may stand before the redirection in the extra area.
    """
    second = _rar_file("b.py", b"", before + rar_redirection(kind, "a.py"), size)
    blocks = [_rar_block(1, 0, _vint(0)), _rar_file("a.py", b"x = 1\n"), second, _rar_block(5, 0, _vint(0))]
    return b"Rar!\x1a\x07\x01\x00" + b"".join(blocks)


def rar_redirection(kind: int, target: str) -> bytes:
    """Return the record of a redirection: 1 Unix link, 2 Windows link, 3 junction, 4 hard link, 5 copy of a file."""
    return rar_record(5, _vint(kind) + _vint(0) + _vint(len(target)) + target.encode())


def rar_record(kind: int, data: bytes) -> bytes:
    """Return one record of an extra area."""
    record = _vint(kind) + data
    return _vint(len(record)) + record


def _rar_file(name: str, content: bytes, extra: bytes = b"", size: int | None = None) -> bytes:
    is_folder = name.endswith("/")
    raw = name.rstrip("/").encode("utf-8", "surrogateescape")
    flags, mode = (0x0001, 0o40755) if is_folder else (0x0004, 0o100644)
    checksum = b"" if is_folder else zlib.crc32(content).to_bytes(4, "little")
    unix, stored = _vint(1), _vint(0)
    body = (
        _vint(flags)
        + _vint(len(content) if size is None else size)
        + _vint(mode)
        + checksum
        + stored
        + unix
        + _vint(len(raw))
        + raw
    )
    return _rar_block(2, 0x0002 | (0x0001 if extra else 0), body, content, extra)


def _rar_block(kind: int, flags: int, body: bytes, content: bytes = b"", extra: bytes = b"") -> bytes:
    sizes = (_vint(len(extra)) if flags & 1 else b"") + (_vint(len(content)) if flags & 2 else b"")
    head = _vint(kind) + _vint(flags) + sizes + body + extra
    sized = _vint(len(head)) + head
    return zlib.crc32(sized).to_bytes(4, "little") + sized + content


def _vint(number: int) -> bytes:
    """Return a number as the format writes it: seven bits a byte, the lowest first."""
    found = bytearray()
    while True:
        number, low = number >> 7, number & 0x7F
        found.append(low | (0x80 if number else 0))
        if not number:
            return bytes(found)


def old_rarred(files: Mapping[str, bytes]) -> bytes:
    """Return a RAR archive of versions 1.5 to 4 that stores its files."""
    blocks = [_old_rar_block(0x73, 0, bytes(6))]
    for name, content in files.items():
        raw = name.encode()
        size, checksum = len(content), zlib.crc32(content)
        unix, version, stored = 3, 20, 0x30
        body = struct.pack("<IIBIIBBHI", size, size, unix, checksum, 0x5A000000, version, stored, len(raw), 0o100644)
        blocks.append(_old_rar_block(0x74, 0x8000, body + raw) + content)
    return b"Rar!\x1a\x07\x00" + b"".join([*blocks, _old_rar_block(0x7B, 0x4000, b"")])


def _old_rar_block(kind: int, flags: int, body: bytes) -> bytes:
    head = struct.pack("<BHH", kind, flags, 7 + len(body)) + body
    return struct.pack("<H", zlib.crc32(head) & 0xFFFF) + head


#: Archives of velocity_publisher.py by py7zr: plain, with a link to /etc/passwd, with a password, with hidden names.
BY_PY7ZR = {
    "plain": base64.b64decode(
        "N3q8ryccAARrqt96dgAAAAAAAAAUAAAAAAAAAPkIBswBAAV4ID0gMQoA4ABoAGRdAACBMweuD85vVl76Dfokg54SHuRzS7wyWA4x"
        "SBQsiIr3jlCU6p1kyBPcshzTsiprxONqUkeOtFEV+bt/6V2wvNER8ruObpeWXLsQJPIix/Cynjx1BEhhKuY817jMpFMKPSAAAAAA"
        "FwYKAQlsAAcLAQABISEBGAxpAAA="
    ),
    "link": base64.b64decode(
        "N3q8ryccAASf40unlQAAAAAAAAAWAAAAAAAAANMe8kMBABB4ID0gMQovZXRjL3Bhc3N3ZADgAIYAeF0AAIEzB64Pz0tvjAfIQ39B"
        "iJqbZ0A6YCrsHcKrED502DTuG/pCbzOK8diXxczD9U/4nwPFEoM7QAmLrudOXxozVrT66vUTsN3SHwTiMo71otL3TC669D0qFmoc"
        "MUolDl5bf+iI7egY1bK2yV33DTwm1PUpP152gAAAABcGFQEJgIAABwsBAAEhIQEYDICHAAA="
    ),
    "locked": base64.b64decode(
        "N3q8ryccAATR2X3zmwAAAAAAAAAWAAAAAAAAAB8xJzEpLzfDdd8GuOLuka6HNsJl4ACEAINdAACBMweuD87zcktvuKZ4g4rj0yFu"
        "bIeP5em5I2uMK9+7Oa50E7JqgpA7hj/PuDKsxBHInMqdnAsyvgzp4bHoT7rDO4NwvlIM+L5hJJVeiZvLxcP5H13bPmHlHMu9osRX"
        "CZKPCEL6JWk7p0VhAJPbh+LGBMxKUfxGJ8fMiTA0yk4oAAAAABcGEAEJgIsABwsBAAEhIQEYDICFAAA="
    ),
    "hidden": base64.b64decode(
        "N3q8ryccAAQYYdCxoAAAAAAAAAAqAAAAAAAAAAqf/+sp7Pvn+4sEmzWzDd/sSgu+i1UGWhaaaS+OtiyTLdPup1VWj1dahbW2XfDH"
        "WIXY1tdZNbNpVuAucnIjkkYzKgLv1UDEk9SSCjw2iqibUI52It/9qUtUR7WEh4Zimf+6Zfn+onYXeHFvHyAq0WFctCQpZ5P4cq4U"
        "46ijBi1ulWh00q/KaWkHD0/gw6OuNuDKVcrHe8CPFowL4dkiPPJ0NknJFwYQAQmAkAAHCwEAASQG8QcBElMPLmI3J+D8qjW7IRkc"
        "zQJawgyAhQAA"
    ),
}
