"""What reaches for the insides of its process: attacks do, and ordinary programs do not."""

from __future__ import annotations

import io
import zipfile
from pathlib import Path

import pytest
from sample_folders import folders_in

from grader.grading.submissions.program_reader import load_encodings, program_description
from grader.grading.submissions.sources import LONG_FILE, UNREADABLE, read_reaches

SUSPICIOUS = {
    "garbage collector": "import gc\ngc.get_objects()",
    "an alias": "from ctypes import CDLL as C\nC(None)",
    "frames": "import sys\nsys._getframe(1)",
    "modules": "import sys\n'_x' in sys.modules",
    "modules of another module": "import logging\n'_x' in logging.sys.modules",
    "a module of another one": "from logging import sys\n'_x' in sys.argv",
    "another module under its private name": "from random import _os\n_os.urandom(1)",
    "the parent by another module": "import logging\nlogging.os.getppid()",
    "processes of a pool": "import concurrent.futures\nconcurrent.futures.ProcessPoolExecutor(2)",
    "memory of an array": "import numpy\nnumpy.zeros(1).__array_interface__",
    "files as memory": "import numpy as np\nnp.memmap('x')",
    "closures": "def f(g):\n    return g.__closure__[0].cell_contents",
    "code": "import time\ntime.sleep.__code__",
    "what replaced a function": "import time\nprint(type(time.sleep))",
    "an import by a text": "__import__('g' + 'c')",
    "evaluated text": "eval('1')",
    "an attribute by a text": "import os\ngetattr(os, 'ti' + 'mes')()",
    "processor time": "import time\ntime.process_time()",
    "file times": "import os\nos.stat('/tmp').st_mtime",
    "processes": "open('/proc/self/status')",
    "processes, joined": "import os\nopen(os.path.join('/', 'proc', 'self', 'maps'))",
    "processes, by parts": "from pathlib import Path\nPath('/', 'proc/self/maps').read_text()",
    "processes, divided": "from pathlib import Path\n(Path('/') / 'dev' / 'shm').iterdir()",
    "children": "import subprocess\nsubprocess.run(['date'])",
    "the environment": "import os\nprint(dict(os.environ))",
    "two clocks": "import time\ntime.time() - time.monotonic()",
    "a loop that counts": "import time\nn = 0\nend = time.time() + 1\nwhile time.time() < end:\n    n += 1",
    "a date": "import time\nx = time.time() < 1767229200",
    "a calendar": "from datetime import datetime\nx = datetime.now().year == 2026",
    "a day": "import time\nx = time.strftime('%m-%d') == '01-01'",
    "a day by its beginning": "from datetime import datetime\nx = datetime.now().isoformat().startswith('2026')",
    "a part of a date": "import time\nx = time.localtime()[7] == 1",
    "days since 1970": "import time\nx = int(time.time()) // 86400 == 20454",
    "a clock that stands": "import time\nx = time.monotonic() == time.monotonic()",
    "work that takes no time": "import time\nt = time.time()\nsum(range(9))\nx = time.time() - t == 0",
    "a pause that is exact": "import time\nt = time.time()\ntime.sleep(1)\nx = abs(time.time() - t - 1) < 1e-6",
    "a clock that stands, by name": "import time\na = time.time_ns()\nb = time.time_ns()\nx = a == b",
    "a ROS clock that stands": "def f(node):\n    a = node.get_clock().now()\n    return a == node.get_clock().now()",
    "a difference by name": "import time\na = time.time()\nsum(range(9))\nd = time.time() - a\nx = d == 0",
    "a long chain of names, last to first": "import time\n"
    + "".join(f"a{n + 1} = a{n}\n" for n in reversed(range(3_000)))
    + "a0 = time.time()\nx = a3000 == a1",
    "few nanoseconds": "import time\na = time.time_ns()\nd = time.time_ns() - a\nx = d < 100",
    "how many times": "import time\nt = []\nt.append(time.time())\nx = len(set([time.time(), time.time()]))",
    "many readings": "import time\nt = [time.time_ns() for _ in range(50)]",
    "hashes of texts": "x = hash('a') == 5",
    "the order of a set": "x = list({'a', 'b', 'c'}) == ['b', 'a', 'c']",
    "a clock from its start": "import time\nx = 999 < time.monotonic() < 1010",
    "a time that nobody sets": "import numpy as np\nx = np.datetime64('now')",
    "an attribute by its text": "from pathlib import Path\nx = getattr(Path('/tmp').stat(), 'st_mtime')",
    "a function by its text": "import time\nx = getattr(time, 'process_time')()",
    "a module's private names": "import sched\nx = sched._time",
    "a function's text": "import time\nx = time.sleep.__doc__",
    "who called": "import warnings\nwarnings.warn('x', stacklevel=4)",
    "a text that names the inside": "for a in ('f_back',):\n    x = getattr(y, a)",
    "a text that is changed": "for a in ('x',):\n    a = a + 'y'\n    x = getattr(y, a)",
    "a stack": "import traceback\ntraceback.extract_stack()",
    "a day as a text": "import datetime\nx = str(datetime.date.today()) == '2026-01-01'",
    "rclpy's inside": "from rclpy.impl.implementation_singleton import rclpy_implementation",
    "the grader": "import _grader_host",
    "a long file": "x = 1\n" * 60_000,
    "parts of a microsecond": "def f(self):\n    if self.get_clock().now().nanoseconds % 1000:\n        return 1",
    "parts of a microsecond, by name": "def f(c):\n    n = c.now().nanoseconds\n    return n % 1000 == 0",
    "parts of a microsecond, if any": "def f(c, us):\n    part = c.now().nanoseconds % us\n    return 1 if part else 2",
    "parts of a microsecond, by divmod": "def f(n):\n    q, r = divmod(n.get_clock().now().nanoseconds, 1000)",
    "parts of a microsecond, by bits": "import time\nx = time.time_ns() & 7",
    "parts of a microsecond, by digits": "import time\nx = str(time.time_ns())[-3:]",
    "parts of a microsecond, by the end of a text": "import time\nx = str(time.time_ns()).endswith('000')",
    "a scaled date": "import time\nx = time.time_ns() / 1e15 < 1768",
    "a scaled date, by name": "import time\nd = time.time() / 86400\nx = d < 20455",
    "a ROS date": "def f(node):\n    return node.get_clock().now().nanoseconds / 1e18 < 1.768",
    "whether any time passes": "import time\nt = time.time()\nsum(range(9))\nif time.time() - t:\n    x = 1",
    "whether any time passes, by name": "import time\na = time.time()\nd = time.time() - a\nx = 1 if d else 2",
    "whether none passes": "import time\na = time.time()\nx = not (time.time() - a)",
    "a loop over a set": "for x in {'a', 'b', 'c'}:\n    break",
    "any element": "x = {'a', 'b', 'c'}.pop()",
    "any element, by name": "seen = set(['a', 'b'])\nx = seen.pop()",
    "the first element": "x = next(iter({'a', 'b'}))",
    "a set as a text": "x = ''.join({'a', 'b', 'c'})",
    "a set in a text": "x = f\"{set('abc')}\"",
    "a set unpacked": "a, b = {'x', 'y'}",
    "a set spread": "print(*{'x', 'y'})",
    "a set of its own": "class A:\n    def f(self):\n        self.s = set()\n        return [x for x in self.s]",
    "a union": "for x in set('ab') | {'c'}:\n    break",
    "a function in a text": "import time\nx = f'{time.sleep}'",
    "a function in a format": "import time\nx = '{}'.format(time.sleep)",
    "a function in an old format": "import time\nx = '%s' % time.sleep",
    "a function that is printed": "import io, time\nprint(time.sleep, file=io.StringIO())",
    "a function as a key": "import time\ntry:\n    {}[time.sleep]\nexcept KeyError as e:\n    x = str(e)",
    "a function's name": "import time\nx = time.sleep.__name__",
    "a function's class": "from time import sleep\nx = sleep.__class__",
    "a pattern": "import time\nmatch time.sleep:\n    case object(__closure__=c):\n        x = c",
    "a pattern of any value": "def f(g):\n    match g:\n        case object(__globals__=c):\n            return c",
    "a pattern of a function": "import time\nmatch time.sleep:\n    case x:\n        pass",
    "a field of a format": "import time\ndef f(g):\n    return '{0.__globals__}'.format(g)",
    "a named field of a format": "def f(g):\n    return '{g.__code__.co_name}'.format(g=g)",
    "an attribute getter": "from operator import attrgetter\nattrgetter('x')",
    "a method caller": "import operator\noperator.methodcaller('x')",
    "a stand-in": "from unittest.mock import patch",
    "documentation": "import pydoc\npydoc.render_doc",
    "settings of logs": "import logging.config",
    "a module's file of names": "import time\nx = time.__dict__",
}
ORDINARY = {
    "a counter": "class A:\n    def tick(self):\n        self.n += 1",
    "an elapsed time": "import time\nstart = time.time()\nwhile time.time() - start < 1:\n    time.sleep(0.1)",
    "an argument": "import sys\nprint(sys.argv[1:])",
    "a variable": "import os\nos.environ.get('ROS_DOMAIN_ID')",
    "kinds": "def f(x):\n    return isinstance(x, float) and type(x) is not int and str(x)",
    "a stamp in a text": "from datetime import datetime\nprint(f'{datetime.now():%H:%M}', datetime.now().isoformat())",
    "a stamp in a name": "import time\nname = time.strftime('%Y-%m-%d') + '.csv'\nopen(name).read()",
    "a deadline": "import time\nend = time.time() + 5\nwhile time.time() < end:\n    time.sleep(0.1)",
    "a period": "import time\ndef f(last):\n    return time.monotonic() - last >= 0.05",
    "its own description": "import argparse\nargparse.ArgumentParser(description=__doc__)",
    "attributes by their texts": "def f(m):\n    return [getattr(m, a) for a in ('x', 'y')]",
    "parameters of its own": "def f(self, params):\n    for p in params:\n        setattr(self, p.name, p.value)",
    "an array in a text": "import numpy as np\ndef f(x):\n    return 'at ' + str(np.round(x, 3))",
    "an error in a log": "import traceback\ndef f(log):\n    log.error(traceback.format_exc())",
    "own private names": "class A:\n    def f(self):\n        return self._x",
    "attributes by their text": "def f(msg):\n    return getattr(msg, 'data', 0.0) if hasattr(msg, 'data') else 0.0",
    "a period in nanoseconds": "import time\ndef f(last):\n    return time.monotonic_ns() - last >= 50_000_000",
    "seconds of nanoseconds": "def f(n, a):\n    d = (n.get_clock().now() - a).nanoseconds / 1e9\n    return d > 5",
    "no time yet": "import time\nlast = time.time() if x else None\nif last == None:\n    y = 1",
    "different numbers": "def f(numbers):\n    return sorted(set(numbers)), len(set(numbers))",
    "no Python": "def f(:",
    "an annotation": "import datetime, threading\nfrom typing import Optional\nx: Optional[datetime.datetime] = None\n"
    "y: dict[str, threading.Timer] = {}",
    "a target of a thread": "import threading, rclpy\nthreading.Thread(target=rclpy.spin, args=(node,)).start()",
    "a time in a text": "import time\nprint(f'{time.time():.3f}', time.time())",
    "a number of a module": "import math\nprint(f'{math.pi:.2f}')",
    "a second of the clock": "def f(self):\n    t = self.get_clock().now().nanoseconds / 1e9\n    return t % 10",
    "whether there is a time": "import time\nstart = None\nstart = time.time()\nif not start:\n    x = 1",
    "whether time runs": "def f(self):\n    return self.get_clock().now().nanoseconds > 0",
    "a rate of its own": "import time\ndef f(last):\n    dt = time.time() - last\n    return 1 / dt if dt > 0 else 0.0",
    "a limit on an elapsed time": "import time\nbegin = time.time()\nelapsed = time.time() - begin\nx = elapsed > 5.0",
    "membership": "x = 'a' in {'a', 'b'}\nseen = set()\nseen.add(x)\nn = len(seen)\nfor y in sorted(seen):\n    pass",
    "a pattern of a message": "def f(m):\n    match m:\n        case Twist(linear=v):\n            return v",
    "a format of fields": "def f(p):\n    return '{0.x:.2f} {p.y}'.format(p, p=p)",
    "a name of a class": "from geometry_msgs.msg import Twist\nprint(Twist.__name__, type(1).__name__)",
    "a version": "import rclpy\nprint(rclpy.__version__)",
    "the rest of a division": "def f(self):\n    return self.n % 10 == 0",
    "bits of its own": "def f(a):\n    return a & 0xFF",
}


def reaching(text: str | bytes) -> list[str]:
    """Return what the contained process tells of a program, here in the test's own."""
    content = text.encode() if isinstance(text, str) else text
    names: list[str] = program_description(content, load_encodings([content])).row["reaches"]
    return names


@pytest.mark.parametrize("text", SUSPICIOUS.values(), ids=SUSPICIOUS)
def test_what_looks_at_its_process_is_found(text: str) -> None:
    """Under any name that it was imported as."""
    assert reaching(text) != []


@pytest.mark.parametrize("text", ORDINARY.values(), ids=ORDINARY)
def test_what_students_write_is_not(text: str) -> None:
    """Ordinary programs cost nothing more."""
    assert reaching(text) == []


def test_few_right_programs_are_suspected() -> None:
    """Of the programs with full marks, at most one in twenty is recorded twice."""
    folders = folders_in("correct", "threads")
    texts = {f.name: [p.read_bytes() for p in sorted(f.rglob("*.py"))] for f in folders}
    suspected = [name for name, own in texts.items() if any(map(reaching, own))]
    assert len(suspected) <= len(folders) / 20


def test_every_file_of_a_submission_counts(tmp_path: Path) -> None:
    """A helper module is part of the program, and one without source is not looked through."""
    (tmp_path / "node.py").write_text("import helper\n")
    assert read_reaches(tmp_path) == ()
    (tmp_path / "lib").mkdir()
    (tmp_path / "lib" / "helper.py").write_text("import gc\n")
    (tmp_path / "fast.so").write_bytes(b"\x7fELF")
    assert read_reaches(tmp_path) == ("a .so file", "gc")
    (tmp_path / "zz.py").write_text("x = 1\n" * 900_000)
    assert read_reaches(tmp_path)[-1] == LONG_FILE


def archive(name: str) -> bytes:
    content = io.BytesIO()
    with zipfile.ZipFile(content, "w") as file:
        file.writestr(zipfile.ZipInfo(name), "x = 1\n")  # without the time, or its row has another name in each process
    return content.getvalue()


@pytest.mark.parametrize(
    ("name", "content", "found"),
    [
        ("long.py", b"x = 1\n" * 200_000, LONG_FILE),
        ("other.py", b"# -*- coding: utf-7 -*-\nx = 1\n", UNREADABLE),
        ("rotated.py", b"# -*- coding: rot13 -*-\nk = 1\n", UNREADABLE),
        ("bytes.py", b"# -*- coding: utf-8 -*-\nx = '\xff'\n", UNREADABLE),
        ("lib.zip", archive("helper.py"), "a .zip file"),
        ("LIB.ZIP", archive("helper.py"), "a .zip file"),
        ("lib.egg", b"", "a .egg file"),
        ("lib.whl", b"", "a .whl file"),
        ("data.bin", archive("helper.py"), "an archive"),
        ("picture.png", b"\x89PNG" + archive("helper.py"), "an archive"),
        ("packed.py", archive("__main__.py"), "an archive"),
        ("helper.pyc", b"", "a .pyc file"),
    ],
)
def test_what_cannot_be_read_is_suspected(tmp_path: Path, name: str, content: bytes, found: str) -> None:
    """It may hold anything."""
    (tmp_path / name).write_bytes(content)
    assert read_reaches(tmp_path) == (found,)


@pytest.mark.parametrize(
    ("name", "content"),
    [
        ("umlaut.py", "# coding: latin-1\nx = 'ü'\n".encode("latin-1")),
        ("windows.py", "# coding: cp1252\nx = '€'\n".encode("cp1252")),
        ("mark.py", "\N{ZERO WIDTH NO-BREAK SPACE}x = 'ü'\n".encode()),
        ("._node.py", b"\0\5\x16\7\0\2\0\0Mac OS X"),
        ("report.docx", archive("word/document.xml")),
        ("notes.txt", b"PK is no archive"),
        ("picture.png", b"\x89PNG\r\n"),
    ],
)
def test_ordinary_files_are_not(tmp_path: Path, name: str, content: bytes) -> None:
    """Programs in the encodings of editors, what file managers leave, and reports."""
    (tmp_path / name).write_bytes(content)
    assert read_reaches(tmp_path) == ()
