"""What reaches for the insides of its process: attacks do, and ordinary programs do not."""

from __future__ import annotations

from pathlib import Path

import pytest

from grader.submissions.sources import LONG, reaching, read_reaches

ROOT = Path(__file__).resolve().parents[2]
SUSPICIOUS = {
    "garbage collector": "import gc\ngc.get_objects()",
    "an alias": "from ctypes import CDLL as C\nC(None)",
    "frames": "import sys\nsys._getframe(1)",
    "modules": "import sys\n'_x' in sys.modules",
    "closures": "def f(g):\n    return g.__closure__[0].cell_contents",
    "code": "import time\ntime.sleep.__code__",
    "what replaced a function": "import time\nprint(type(time.sleep))",
    "an import by a text": "__import__('g' + 'c')",
    "evaluated text": "eval('1')",
    "an attribute by a text": "import os\ngetattr(os, 'ti' + 'mes')()",
    "processor time": "import time\ntime.process_time()",
    "file times": "import os\nos.stat('/tmp').st_mtime",
    "processes": "open('/proc/self/status')",
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
}


@pytest.mark.parametrize("text", SUSPICIOUS.values(), ids=SUSPICIOUS)
def test_what_looks_at_its_process_is_found(text: str) -> None:
    """Under any name that it was imported as."""
    assert reaching(text) != ()


@pytest.mark.parametrize("text", ORDINARY.values(), ids=ORDINARY)
def test_what_students_write_is_not(text: str) -> None:
    """Ordinary programs cost nothing more."""
    assert reaching(text) == ()


def test_few_right_programs_are_suspected() -> None:
    """Of the programs with full marks, at most one in twenty is recorded twice."""
    folders = [f for group in ("correct", "threads") for f in (ROOT / "tests/submissions" / group).iterdir()]
    suspected = [f.name for f in folders if f.is_dir() and read_reaches(f)]
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
    assert read_reaches(tmp_path)[-1] == LONG
