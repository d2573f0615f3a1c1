"""The program of a worker: executes its starter, then imports the worker while the starter imports rclpy."""

from __future__ import annotations

import json
import os
import sys

from grader.execution.sandbox.starter_process import execute


def main() -> None:
    """Run plans until the supervisor closes the socket."""
    request = json.loads(sys.argv[1])
    executed = execute(**request["starter"]) if request["starter"] else None
    from grader.execution.worker import serve  # noqa: PLC0415 - the starter imports meanwhile

    serve(request, executed)


if __name__ == "__main__":
    os.chdir("/")
    main()
