"""Builds the environments of worker and student processes, without any variable of the caller's."""

from __future__ import annotations

import os
import site
from collections.abc import Mapping
from pathlib import Path

import grader
from grader.runtime.host.machine import ADDRESS, ADDRESS_6, BACKEND, HOST_NAME, SHELL, USER, USER_ID
from grader.runtime.model.releases import DEFAULT, release_of
from grader.runtime.model.trace import ClockKind
from grader.runtime.ros_installation import PythonRuntime
from grader.runtime.sandbox.protocol import StudentProcess

PACKAGE = Path(grader.__file__).resolve().parent

# Worker and student must use the same values. With its default transports Fast DDS would use /dev/shm, which the two do
# not share. ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST would enable that transport again, so it must stay unset.
DDS_SETTINGS: Mapping[str, str] = {
    "RMW_IMPLEMENTATION": "rmw_fastrtps_cpp",
    "FASTDDS_BUILTIN_TRANSPORTS": "UDPv4",
    # A DEFAULT_FASTRTPS_PROFILES.xml in the working directory would be loaded otherwise.
    "SKIP_DEFAULT_XML_FILE": "1",
}

# One malloc arena, and one thread per library, so that memory and threads of a node depend little on the processors.
FEW_RESOURCES: Mapping[str, str] = {
    "OPENBLAS_NUM_THREADS": "1",
    "OMP_NUM_THREADS": "1",
    "MKL_NUM_THREADS": "1",
    "MALLOC_ARENA_MAX": "2",
}


#: The profile for quick discovery, which processes without the grader's code see as well.
QUICK = "fastdds"
#: What the names of profiles end with whose participants stay in the graph until somebody ends their lease.
VIRTUAL = "_virtual"


def dds_profile(folder: str | Path, name: str, distro: str) -> dict[str, str]:
    """Return the variable that names a Fast DDS profile in a folder, as the process sees it.

    `NAME.xml` is the profile for Fast DDS 2, `NAME3.xml` for Fast DDS 3.
    """
    if release_of(distro).fast_dds == 2:
        return {"FASTRTPS_DEFAULT_PROFILES_FILE": f"{folder}/{name}.xml"}
    return {"FASTDDS_DEFAULT_PROFILES_FILE": f"{folder}/{name}3.xml"}


def quick_discovery(host_folder: str | Path, runtime: PythonRuntime, clock: str = "") -> dict[str, str]:
    """Return the variable that makes Fast DDS repeat discovery quickly; the profile is in the host package.

    Without it, what Fast DDS 2.14 loses while two participants discover each other comes three seconds later. On the
    virtual clock, the middleware does not end the lease of a process, which it would count in real time.
    """
    name = f"{QUICK}{VIRTUAL}" if clock == ClockKind.VIRTUAL.value else f"machine/{QUICK}"
    return dds_profile(host_folder, name, distro_of(runtime.environment))


def on_loopback(folder: str | Path, environment: Mapping[str, str]) -> dict[str, str]:
    """Return the variable that keeps Fast DDS to the loopback address, by a profile for the same clock in a folder."""
    known = dds_profile("", "", distro_of(environment))
    virtual = any(VIRTUAL in environment.get(name, "").rpartition("/")[2] for name in known)
    return dds_profile(folder, f"loopback{VIRTUAL if virtual else ''}", distro_of(environment))


def distro_of(environment: Mapping[str, str]) -> str:
    """Return the ROS release that an environment is for."""
    return environment.get("ROS_DISTRO", DEFAULT.name)


def runtime_environment(runtime: PythonRuntime) -> dict[str, str]:
    """Return the variables that any process with ROS needs, workers and students' processes alike."""
    environment = {
        "PATH": "/usr/bin:/bin",
        "LANG": "C.UTF-8",
        "TZ": "UTC",
        "PYTHONDONTWRITEBYTECODE": "1",
        "PYTHONUTF8": "1",
        **runtime.environment,
        **DDS_SETTINGS,
        **FEW_RESOURCES,
    }
    if runtime.library_paths:
        environment["LD_LIBRARY_PATH"] = ":".join(map(str, runtime.library_paths))
    if runtime.python_paths:
        environment["PYTHONPATH"] = ":".join(map(str, runtime.python_paths))
    return environment


def worker_environment(runtime: PythonRuntime, home: Path) -> dict[str, str]:
    """Return the environment of a trusted worker, with ROS and this package; ROS writes its logs to `home`.

    It names the folders of installed packages, because workers start with `-S`: what `site` does takes as long as
    starting Python.
    """
    environment = runtime_environment(runtime)
    python_paths = [environment["PYTHONPATH"]] if "PYTHONPATH" in environment else []
    installed = [path for path in site.getsitepackages() if Path(path).is_dir()]
    return {
        **environment,
        **quick_discovery(PACKAGE / "runtime" / "host", runtime),
        "PYTHONPATH": os.pathsep.join([*python_paths, str(PACKAGE.parent), *installed]),
        "HOME": str(home),
        "ROS_LOG_DIR": str(home),
    }


def student_environment(process: StudentProcess, home: Path) -> dict[str, str]:
    """Return the complete environment of a student's process; its own variables take precedence.

    The process may write to `home`, which is the path as it sees it.
    """
    return {
        **runtime_environment(process.runtime),
        "PATH": "/usr/bin",
        "HOME": str(home),
        "TMPDIR": str(home.parent),  # some tiers allow no other place
        "USER": USER,
        "LOGNAME": USER,
        "SHELL": SHELL,
        **BACKEND,
        "PYTHON_GIL": "1",  # only one thread at a time, also where Python was built without the lock
        "ROS_LOG_DIR": str(home / "log"),
        # With this, an int in a float field raises an exception with a line, instead of aborting.
        "ROS_PYTHON_CHECK_FIELDS": "1",
        **process.environment,
    }


def account_files(user: int, group: int, home: Path) -> dict[str, bytes]:
    """Return the files of /etc from which the C library knows users and hosts, for a user of a student's process.

    The program's own user and the addresses of these hosts are fixed by `grader.runtime.host.machine`; these files say
    the same to C code, and answer what else it asks Python for.
    """
    ids = dict.fromkeys(((USER_ID, USER_ID), (user, group)))
    users = [f"{USER}:x:{number}:{own}:{USER}:{home}:{SHELL}" for number, own in ids]
    groups = [f"{USER}:x:{number}:" for number in dict.fromkeys(own for _, own in ids)]
    files = {
        "passwd": [f"root:x:0:0:root:/root:{SHELL}", *users],
        "group": ["root:x:0:", *groups],
        "hosts": [f"{ADDRESS} localhost {HOST_NAME}", f"{ADDRESS_6} localhost {HOST_NAME}"],
        "nsswitch.conf": ["passwd: files", "group: files", "hosts: files"],
    }
    return {name: "\n".join([*lines, ""]).encode() for name, lines in files.items()}
