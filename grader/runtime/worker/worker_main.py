"""The program of a worker: executes its starter, then imports the worker while the starter imports rclpy."""

from __future__ import annotations

import gc
import json
import os
import resource
import sys

from grader.runtime.host.machine import even_inherited
from grader.runtime.host.quick_imports import import_without_needless
from grader.runtime.sandbox.starter_process import execute
from grader.runtime.worker import late_numpy

#: Garbage is collected after so many new objects: imports make many, and steps hardly any that are garbage.
COLLECT_AFTER = 50_000
#: The stack of a thread, in bytes: the default of Linux. The shell's limit would decide how deep C code can recurse.
STACK_BYTES = 8 << 20


def main() -> None:
    """Run plans until the supervisor closes the socket."""
    even_inherited()
    limit_stack()
    gc.set_threshold(COLLECT_AFTER)
    request = json.loads(sys.argv[1])
    late_numpy.install()
    executed = execute(**request["starter"]) if request["starter"] else None
    from grader.runtime.worker.worker import serve  # noqa: PLC0415 - the starter imports meanwhile

    import_without_needless("rosidl_generator_py")
    serve(request, executed)


def limit_stack() -> None:
    """Set the limit of stacks that all processes inherit, unless a lower one is forced on this process."""
    _, most = resource.getrlimit(resource.RLIMIT_STACK)
    resource.setrlimit(resource.RLIMIT_STACK, (STACK_BYTES if most == -1 else min(STACK_BYTES, most), most))


if __name__ == "__main__":
    os.chdir("/")
    main()
