"""Counts which thread goes on first in plain CPython, and compares it with the order in virtual time.

Usage: python benchmarks/thread_order.py [REPEATS] [NAME...]
       Runs each program of tests/runtime/host/thread_orders.py REPEATS times (200), without the grader, and prints the
       orders by how often they came, most frequent first; `=` marks that of virtual time. What comes first is decided
       by 5 ms, CPython's switch interval, and by how fast the system wakes a thread: run it on an idle machine.
"""

from __future__ import annotations

import collections
import json
import subprocess
import sys
import textwrap
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "tests" / "runtime" / "host"))

from thread_orders import IMPORTS, ORDERS

#: Prints a list of orders.
PROGRAM = """
import json, sys
NOTED = []
note = NOTED.append
def write(word):
    note(word)
    sys.stderr.write(".")
    sys.stderr.flush()
code, repeats = compile(sys.argv[1], "program", "exec"), int(sys.argv[2])
orders = []
for _ in range(repeats):
    NOTED.clear()
    exec(code, globals())
    orders.append(" ".join(NOTED))
print(json.dumps(orders))
"""


def measured(code: str, repeats: int) -> collections.Counter[str]:
    """Return how often a program noted its words in which order."""
    command = [sys.executable, "-c", PROGRAM, IMPORTS + textwrap.dedent(code), str(repeats)]
    found = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, check=True)
    return collections.Counter(json.loads(found.stdout))


def main() -> int:
    """Print the table; return 1 if the order of virtual time is not the most frequent one of a program."""
    repeats = int(sys.argv[1]) if len(sys.argv) > 1 else 200
    others = 0
    for name in sys.argv[2:] or ORDERS:
        code, virtual = ORDERS[name]
        orders = measured(code, repeats).most_common()
        others += orders[0][0] != virtual
        print(name)
        for order, times in orders[:4]:
            print(f"{times:7} {'=' if order == virtual else ' '} {order}", flush=True)
    print(f"{others} of {len(sys.argv[2:] or ORDERS)} programs mostly have another order than in virtual time")
    return min(others, 1)


if __name__ == "__main__":
    sys.exit(main())
