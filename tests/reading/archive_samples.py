"""Builds archives for tests, honest and hostile, with the standard library."""

import io
import stat
import tarfile
import zipfile


def zipped(files, compression=zipfile.ZIP_DEFLATED, modes=None):
    """Return a zip of name -> content; a name that ends in `/` is a folder; `modes` gives a Unix mode by name."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", compression) as archive:
        for name, content in files if isinstance(files, list) else files.items():
            info = zipfile.ZipInfo("x")
            info.filename = name  # the constructor would mend some names
            info.compress_type = compression
            info.external_attr = (modes or {}).get(name, stat.S_IFREG | 0o644) << 16
            archive.writestr(info, content)
    return buffer.getvalue()


def tarred(files, compression="", types=None, format_=tarfile.PAX_FORMAT):
    """Return a tar of name -> content, `compression` as in `tarfile.open`; `types` gives a type by name."""
    buffer = io.BytesIO()
    with tarfile.open(fileobj=buffer, mode=f"w:{compression}", format=format_, errors="surrogateescape") as archive:
        for name, content in files if isinstance(files, list) else files.items():
            info = tarfile.TarInfo(name)
            info.type = (types or {}).get(name, tarfile.REGTYPE)
            if info.type in (tarfile.LNKTYPE, tarfile.SYMTYPE):
                info.linkname = content.decode()
            info.size = len(content) if info.isreg() else 0
            archive.addfile(info, io.BytesIO(content))
    return buffer.getvalue()
