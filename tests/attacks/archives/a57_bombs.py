"""Archives and files that are small until somebody opens them, or that stop whoever reads them."""

import io
import tarfile
import zipfile

MIB = 1 << 20
NODE = b"import rclpy\n"


def build(outside):
    """Return what is handed in, by file name."""
    return {
        "bomb.zip": _zip({"velocity_publisher.py": NODE, "data.bin": bytes(300 * MIB)}),
        "nested.zip": _zip({"inner.zip": _zip({"inner.zip": _zip({"data.bin": bytes(100 * MIB)})})}),
        "many.zip": _zip({f"file_{number}.py": b"" for number in range(100_000)}, zipfile.ZIP_STORED),
        "deep.zip": _zip({"a/" * 2000 + "velocity_publisher.py": NODE}),
        "overlapping.zip": _overlapping(),
        "bomb.tar.xz": _tar({"velocity_publisher.py": NODE, "data.bin": bytes(300 * MIB)}, "w:xz"),
        "sparse.tar": _sparse(),
        "one_line/velocity_publisher.py": b"x = " + b"1 + " * 200_000 + b"1\n",
        "brackets/velocity_publisher.py": b"x = " + b"[" * 100_000 + b"]" * 100_000 + b"\n",
        "long_line/velocity_publisher.py": b"x = '" + b"a" * (7 * MIB) + b"'\n",
    }


def _zip(files, method=zipfile.ZIP_DEFLATED):
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", method) as archive:
        for name, content in files.items():
            archive.writestr(name, content)
    return buffer.getvalue()


def _tar(files, mode):
    buffer = io.BytesIO()
    with tarfile.open(fileobj=buffer, mode=mode) as archive:
        for name, content in files.items():
            member = tarfile.TarInfo(name)
            member.size = len(content)
            archive.addfile(member, io.BytesIO(content))
    return buffer.getvalue()


def _overlapping():
    """Return an archive in which a thousand names share the data of one."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("data.bin", bytes(20 * MIB))
        first = archive.infolist()[0]
        for number in range(1000):
            copy = zipfile.ZipInfo(f"data_{number}.bin")
            for name in ("header_offset", "compress_size", "file_size", "CRC", "compress_type"):
                setattr(copy, name, getattr(first, name))
            archive.filelist.append(copy)
            archive.NameToInfo[copy.filename] = copy
        archive._didModify = True
    return buffer.getvalue()


def _sparse():
    """Return an archive that says of a member that it has a tebibyte."""
    member = tarfile.TarInfo("data.bin")
    member.size = 1 << 40
    return member.tobuf(tarfile.GNU_FORMAT) + bytes(1024)
