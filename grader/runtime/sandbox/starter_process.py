"""Executes a starter, with the standard library alone: other imports take as long as the starter's own."""

from __future__ import annotations

import json
import socket
import subprocess
from collections.abc import Mapping, Sequence
from typing import Any, TypeAlias

#: The worker's end of the connection, and the process.
StarterProcess: TypeAlias = tuple[socket.socket, "subprocess.Popen[bytes]"]


def execute(argv: Sequence[str], told: Mapping[str, Any], environment: Mapping[str, str]) -> StarterProcess:
    """Execute a starter.

    Args:
        argv: The command.
        told: Content of its last argument, besides the number of its socket.
        environment: Its complete environment.
    """
    line, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    process = subprocess.Popen(
        [*argv, json.dumps({**told, "line": theirs.fileno()})],
        env=dict(environment),
        pass_fds=(theirs.fileno(),),
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        start_new_session=True,
    )
    theirs.close()
    return line, process
