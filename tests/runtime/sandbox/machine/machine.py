"""Prints what a program can see of the machine, a row of docs/reference/machine.md in each log record."""

import concurrent.futures
import datetime
import getpass
import glob
import locale
import logging
import multiprocessing
import os
import pathlib
import platform
import pwd
import random
import resource
import secrets
import shutil
import signal
import socket
import sqlite3
import sys
import tempfile
import threading
import time
import uuid

import rclpy
from rclpy.executors import MultiThreadedExecutor
from rclpy.node import Node

LIMITS = ("RLIMIT_STACK", "RLIMIT_AS", "RLIMIT_NOFILE", "RLIMIT_FSIZE", "RLIMIT_CORE", "RLIMIT_CPU")


def folders():
    place = tempfile.mkdtemp()
    for name in ("b", "a", "d", "c", "B"):
        pathlib.Path(place, name).touch()
    found = [os.listdir(place), [p.name for p in pathlib.Path(place).iterdir()], next(os.walk(place))[2]]
    with os.scandir(place) as entries:
        found.append([entry.name for entry in entries])
    found.append([os.path.basename(path) for path in glob.glob(os.path.join(place, "*"))])
    return found


def temporary_files():
    place = pathlib.Path("/tmp/notes")
    place.mkdir()
    (place / "a.txt").write_text("a")
    with open(b"/tmp/notes/b.txt", "w") as file:
        file.write("bb")
    os.chmod("/tmp/notes/a.txt", 0o600)
    shutil.copy("/tmp/notes/a.txt", "/tmp/../tmp/notes/c.txt")
    os.rename("/tmp/notes/b.txt", place / "d.txt")
    (place / "c.txt").touch()
    logging.FileHandler("/tmp/notes/e.log").close()
    sqlite3.connect("/tmp/notes/f.db").execute("create table t (x)").connection.close()
    found = [
        sorted(os.listdir("/tmp/notes")), [str(path) for path in place.iterdir()], list(os.walk("/tmp/notes")),
        os.stat("/tmp/notes/d.txt").st_size, os.path.exists("/tmp/notes/b.txt"), glob.glob("/tmp/notes/*.txt"),
        os.access("/tmp", os.W_OK), "notes" in os.listdir("/tmp"),
    ]
    shutil.rmtree("/tmp/notes")
    try:
        os.chmod("/tmp/none", 0o600)
    except OSError as error:
        found.append(str(error))
    return found, place.exists()


def chosen():
    os.sched_setaffinity(0, {0, 1})
    fewer = os.sched_getaffinity(0)
    os.sched_setaffinity(0, range(4))
    return fewer, os.sched_getaffinity(0)


def ignored():
    return [s.name for s in signal.valid_signals() if isinstance(s, signal.Signals) and signal.getsignal(s) is signal.SIG_IGN]


def environment():
    by_place = ("ROS_DOMAIN_ID", "HOME", "TMPDIR", "PWD", "ROS_LOG_DIR")
    return sorted(
        (name, "" if name in by_place or "PATH" in name or value.startswith("/") else value)
        for name, value in os.environ.items()
    )


def windows():
    try:
        import matplotlib.pyplot as plt
    except ImportError:
        return "no matplotlib"
    figure = plt.figure()
    start = time.monotonic()
    plt.pause(0.2)
    return plt.get_backend(), type(figure.canvas.manager).__name__, time.monotonic() - start >= 0.2


def fonts():
    try:
        import matplotlib
        from matplotlib import font_manager
    except ImportError:
        return "no matplotlib"
    own = matplotlib.get_data_path()
    return sorted(os.path.relpath(font.fname, own) for font in font_manager.fontManager.ttflist)


ROWS = {
    "processors": lambda: (
        os.cpu_count(), os.sched_getaffinity(0), multiprocessing.cpu_count(),
        getattr(os, "process_cpu_count", lambda: 4)(), concurrent.futures.ThreadPoolExecutor()._max_workers,
        MultiThreadedExecutor()._executor._max_workers, chosen(),
    ),
    "user and group": lambda: (
        getpass.getuser(), os.environ["USER"], os.getuid(), os.geteuid(), os.getgid(), os.getgroups(), os.getlogin(),
        pwd.getpwuid(os.getuid())[:5], pathlib.Path("/tmp").home().name,
    ),
    "home": lambda: (pathlib.Path.home(), os.path.expanduser("~/x"), os.environ["HOME"], pwd.getpwuid(1000).pw_dir),
    "host name": lambda: (socket.gethostname(), platform.node(), os.uname().nodename, platform.uname().node),
    "names of hosts": lambda: (
        socket.gethostbyname("localhost"), socket.gethostbyname(socket.gethostname()),
        socket.getaddrinfo("localhost", 80, type=socket.SOCK_STREAM),
        socket.getaddrinfo("localhost", 80, socket.AF_INET6, socket.SOCK_STREAM),
    ),
    "kernel": lambda: (os.uname()[2:4], platform.release(), platform.system(), platform.version()),
    "hardware address": lambda: (hex(uuid.getnode()), uuid.uuid1().node),
    "time zone": lambda: (time.tzname, time.timezone, datetime.datetime.now().astimezone().tzinfo),
    "locale": lambda: (locale.getlocale(), sys.getfilesystemencoding(), sys.stdout.encoding, f"{1234.5:n}"),
    "terminal": lambda: (sys.stdin.read(), sys.stdout.isatty(), shutil.get_terminal_size(), os.environ.get("TERM")),
    "environment": environment,
    "limits": lambda: [resource.getrlimit(getattr(resource, name))[0] for name in LIMITS],
    "umask and signals": lambda: (os.umask(0o022), ignored(), signal.pthread_sigmask(signal.SIG_BLOCK, ())),
    "hash seed": lambda: (hash("text"), list({"a", "b", "c", "d"})),
    "randomness": lambda: (
        random.random(), secrets.token_hex(8), os.urandom(8), os.getrandom(8), uuid.uuid4(), random.SystemRandom().random(),
    ),
    "temporary names": lambda: (tempfile.gettempdir(), tempfile.mkdtemp(), os.path.basename(tempfile.mktemp())),
    "files in /tmp": temporary_files,
    "order of folders": folders,
    "Python flags": lambda: (
        sys.flags, [os.path.basename(a) for a in (*sys.argv, *sys.orig_argv[1:])], sys._xoptions, sys.getrecursionlimit(),
        sys.getswitchinterval(), sys.warnoptions,
    ),
    "windows": windows,
    "fonts": fonts,
    "free threading": lambda: (getattr(sys, "_is_gil_enabled", lambda: True)(), threading.active_count() > 0),
}


def main():
    rclpy.init()
    node = Node("machine")
    for name, look in ROWS.items():
        node.get_logger().info(f"{name} = {look()!r}")


if __name__ == "__main__":
    main()
