"""Archives whose members want to be written elsewhere, to be something else, or to be two at once."""

import io
import tarfile
import zipfile

MARKER = b"this was not to be written here\n"


def build(outside):
    """Return what is handed in, by file name; `outside` is a folder that members try to be written to."""
    marker = f"{outside}/marker-a66".lstrip("/")
    names = {
        "parent": "../" * 12 + marker,
        "absolute": "/" + marker,
        "middle": "a/../" * 3 + "../" * 12 + marker,
        "backslash": "..\\" * 12 + marker.replace("/", "\\"),
        "drive": "C:" + "\\marker-a66",
        "newline": "velocity\n_publisher.py",
        "reserved": "CON.py",
        "control": "velocity_\x1b[2Jpublisher.py",
    }
    built = {f"{what}.zip": _zip([(name, MARKER)]) for what, name in names.items()}
    built |= {f"{what}.tar.gz": _tar([_file(name)]) for what, name in names.items()}
    built["null.zip"] = _zip([("velocityXpublisher.py", MARKER)]).replace(b"velocityX", b"velocity\0")
    built["twice.zip"] = _zip([("velocity_publisher.py", b"first\n"), ("velocity_publisher.py", b"second\n")])
    built["cases.zip"] = _zip([("velocity_publisher.py", b"first\n"), ("Velocity_Publisher.PY", b"second\n")])
    built["link.zip"] = _zip_link("velocity_publisher.py", f"{outside}/secret")
    built["link.tar"] = _tar([_link("velocity_publisher.py", f"{outside}/secret", tarfile.SYMTYPE)])
    built["hard_link.tar"] = _tar([_link("velocity_publisher.py", f"{outside}/secret", tarfile.LNKTYPE)])
    through = [_link("there", str(outside), tarfile.SYMTYPE), _file("there/marker-a66")]
    built["through_a_link.tar"] = _tar(through)
    built["device.tar"] = _tar([_device("velocity_publisher.py")])
    built["pipe.tar"] = _tar([_link("velocity_publisher.py", "", tarfile.FIFOTYPE)])
    return built


def _zip(members):
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        for number, (name, content) in enumerate(members):
            placeholder = f"member{number}"
            archive.writestr(placeholder, content)
            # After the check of names that the library makes for honest writers.
            archive.filelist[-1].filename = archive.filelist[-1].orig_filename = name
    return buffer.getvalue()


def _zip_link(name, target):
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        member = zipfile.ZipInfo(name)
        member.create_system = 3
        member.external_attr = 0o120777 << 16
        archive.writestr(member, target)
    return buffer.getvalue()


def _tar(members):
    buffer = io.BytesIO()
    with tarfile.open(fileobj=buffer, mode="w:gz", format=tarfile.PAX_FORMAT) as archive:
        for member in members:
            archive.addfile(member, io.BytesIO(MARKER) if member.isreg() else None)
    return buffer.getvalue()


def _file(name):
    member = tarfile.TarInfo(name)
    member.size = len(MARKER)
    return member


def _link(name, target, kind):
    member = tarfile.TarInfo(name)
    member.type, member.linkname = kind, target
    return member


def _device(name):
    member = tarfile.TarInfo(name)
    member.type, member.devmajor, member.devminor = tarfile.CHRTYPE, 1, 5
    return member
