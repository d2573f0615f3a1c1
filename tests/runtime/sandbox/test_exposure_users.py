"""Users that student processes become: no two of one machine are the same."""

import subprocess
import sys
from pathlib import Path

from grader.runtime.sandbox import exposure

TAKES_ALL_BUT_A_HUNDRED = """
import fcntl, os, sys
file = os.open(sys.argv[1], os.O_CREAT | os.O_RDWR)
for user in range(61234, 65234):
    if not 61700 <= user < 61800:
        fcntl.lockf(file, fcntl.LOCK_EX | fcntl.LOCK_NB, 1, user)
print("taken", flush=True)
sys.stdin.read()
"""


def test_no_two_graders_take_one_user(tmp_path: Path) -> None:
    """A fork bomb of one student would take the threads of another's node, whose loss would look like its own fault."""
    argv = [sys.executable, "-I", "-c", TAKES_ALL_BUT_A_HUNDRED, str(tmp_path / "users")]
    with subprocess.Popen(argv, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as other:
        assert other.stdout is not None
        assert other.stdout.readline() == b"taken\n"
        users = exposure.StudentUsers(tmp_path / "users")
        # A thousand draws miss the 91 users that are free for the last of them once in 10**10 times
        own = {users.next() for _ in range(10)}
        assert len(own) == 10
        assert own <= {*range(61700, 61800)}
        other.communicate()
    assert len(own | {users.next() for _ in range(1000)}) == 1010


def test_without_a_place_for_locks_users_are_still_handed_out(tmp_path: Path) -> None:
    """A read-only machine grades too; two students of one grader then still differ."""
    users = exposure.StudentUsers(tmp_path / "missing" / "users")
    assert len({users.next() for _ in range(1000)}) == 1000
