"""The program of a worker: executes its starter, then imports the worker while the starter imports rclpy."""

from __future__ import annotations

import gc
import json
import os
import sys

from grader.execution import late_numpy
from grader.execution.sandbox.starter_process import execute
from grader.student_host.quick_imports import import_without_needless

#: Garbage is collected after so many new objects: imports make many, and steps hardly any that are garbage.
COLLECT_AFTER = 50_000


def main() -> None:
    """Run plans until the supervisor closes the socket."""
    gc.set_threshold(COLLECT_AFTER)
    request = json.loads(sys.argv[1])
    late_numpy.install()
    executed = execute(**request["starter"]) if request["starter"] else None
    from grader.execution.worker import serve  # noqa: PLC0415 - the starter imports meanwhile

    import_without_needless("rosidl_generator_py")
    serve(request, executed)


if __name__ == "__main__":
    os.chdir("/")
    main()
