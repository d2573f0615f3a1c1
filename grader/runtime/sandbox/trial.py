"""The worker of a self-test: starts a probe like a student's process, exchanges messages, and records its effects.

Usage: python -m grader.runtime.sandbox.trial JSON, with an object of `isolation`, `runtime`, `submission` and a
file `staged` in it, `domain`, and `probe`, what the probe is to try. Prints one JSON line: `achieved`, by property;
`outgrown`; and `said`, the last line of the probe's errors.
"""

from __future__ import annotations

import json
import os
import resource
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import IO, Any

from grader.runtime.host.originals import wait_until
from grader.runtime.model.limits import Limits
from grader.runtime.recording.codec import from_json
from grader.runtime.ros_installation import PythonRuntime
from grader.runtime.sandbox import probe
from grader.runtime.sandbox.environment import quick_discovery
from grader.runtime.sandbox.properties import EXCHANGE, NO_EXCHANGE
from grader.runtime.sandbox.protocol import Isolation, StudentProcess
from grader.runtime.sandbox.start import SPARE
from grader.runtime.sandbox.starter import StartedProcess, Starter
from grader.runtime.sandbox.tiers import HOST, isolation_from_name

#: Seconds in which a message must have come back, and between two attempts to send it.
EXCHANGE_S, AGAIN_S = 15.0, 0.03
LIMITS = Limits(processes=48)


def main() -> None:
    """Run the trial that the command line describes."""
    request: dict[str, Any] = json.loads(sys.argv[1])
    segment = Path("/dev/shm") / f"grade-probe-{os.getpid()}"  # noqa: S108
    segment.write_bytes(b"segment")
    segment.chmod(0o666)
    try:
        answer = trial(request, str(segment))
    finally:
        segment.unlink()
    print(json.dumps(answer), flush=True)  # noqa: T201 -- the answer
    # Shutting ROS down takes longer than everything else here.
    os._exit(0)


def trial(request: dict[str, Any], segment: str) -> dict[str, Any]:
    """Start the probe, exchange a message with it, and return what it achieved."""
    signals: list[int] = []
    signal.signal(signal.SIGUSR1, lambda number, _: signals.append(number))
    before = condition()
    reading, writing = os.pipe()
    with started(request, segment, reading) as process:
        answered, kept = exchange_messages(process, request["domain"])
        os.close(writing)  # ends the exchange
        with ThreadPoolExecutor() as pool:  # so that neither stream blocks the probe
            out, err = pool.map(rest_of, (process.stdout, process.stderr))
    lines = out.decode("utf-8", "replace").splitlines()
    errors = err.decode("utf-8", "replace").strip().splitlines()
    achieved: dict[str, list[str]] = json.loads(lines[0]) if lines else {}
    if achieved and not (answered and kept):
        achieved[EXCHANGE].append(NO_EXCHANGE)
    if achieved and (signals or condition() != before):
        achieved["signals"].append("it affected the worker")
    return {"achieved": achieved, "outgrown": lines[1:] == ["outgrown"], "said": errors[-1][:300] if errors else ""}


def condition() -> Mapping[str, object]:
    """Return the properties of this process that another process could change."""
    return {
        "limit": resource.getrlimit(resource.RLIMIT_MSGQUEUE),
        "priority": os.getpriority(os.PRIO_PROCESS, 0),
        "processors": sorted(os.sched_getaffinity(0)),
    }


def rest_of(stream: IO[bytes] | None) -> bytes:
    """Return the rest of a stream."""
    return b"" if stream is None else stream.read()


@contextmanager
def started(request: dict[str, Any], segment: str, stdin: int) -> Iterator[subprocess.Popen[bytes] | StartedProcess]:
    """Start the probe in the way in which students' processes are started here, and end it."""
    isolation, process = probe_process(request, segment)
    with ExitStack() as stack:
        if isolation.can_fork:
            starter = Starter("", process.runtime, isolation.host_seen_at)
            stack.callback(starter.close)
            _, theirs = (stack.enter_context(end) for end in socket.socketpair())
            probe = starter.start(
                isolation.prepared_sandbox(process, LIMITS),
                {},
                (str(process.runtime.executable), *process.arguments),
                theirs,
                stdin,
            )
            stack.callback(probe.close)
            yield probe
            return
        command = isolation.student_command(process, LIMITS)
        for descriptor in command.opened_fds:
            stack.callback(os.close, descriptor)
        yield stack.enter_context(
            subprocess.Popen(
                command.argv,
                env=dict(command.environment),
                pass_fds=command.pass_fds,
                stdin=stdin,
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
                start_new_session=True,
            )
        )


def probe_process(request: dict[str, Any], segment: str) -> tuple[Isolation, StudentProcess]:
    """Return the tier, and the probe as a student's process."""
    isolation = isolation_from_name(request["isolation"])
    runtime = from_json(PythonRuntime, request["runtime"])
    told = {
        **request["probe"],
        "worker": os.getpid(),
        "shared": isolation.shares_network,
        "segments": [*request["probe"]["segments"], segment],
        "memory": LIMITS.address_space_bytes,
        "threads": 2 * (LIMITS.processes + SPARE),
        "scratch": LIMITS.scratch_bytes,
    }
    seen_at = isolation.submission_seen_at or request["submission"]
    told["files"] = [*told["files"], f"{seen_at}/{request['staged']}"]
    told["closed"] = [*told["closed"], seen_at, str(Path(seen_at).parent)]
    source = Path(probe.__file__).read_text(encoding="utf-8")
    return isolation, StudentProcess(
        runtime=runtime,
        host_folder=HOST,
        submission=Path(request["submission"]),
        arguments=("-s", "-u", "-B", "-c", source, json.dumps(told)),
        environment={"ROS_DOMAIN_ID": str(request["domain"]), **quick_discovery(isolation.host_seen_at, runtime)},
        pass_fds=(),
    )


def exchange_messages(process: subprocess.Popen[bytes] | StartedProcess, domain: int) -> tuple[bool, Any]:
    """Send a message until it comes back from the probe; return whether it did while that ran, and the node."""
    import rclpy  # noqa: PLC0415 -- the probe starts meanwhile
    from std_msgs.msg import String  # noqa: PLC0415

    rclpy.init(domain_id=domain)
    node = rclpy.create_node("trial", start_parameter_services=False, enable_rosout=False)
    nonce = os.urandom(8).hex()
    replies: list[str] = []
    node.create_subscription(String, "probe_back", lambda message: replies.append(message.data), 10)
    forth = node.create_publisher(String, "probe_forth", 10)
    again = 0.0

    def came() -> bool:
        """Send it again if that is due, and look for an answer; also true if none can come any more."""
        nonlocal again
        # An endpoint that is not matched yet does not receive messages.
        if (now := time.monotonic()) >= again and forth.get_subscription_count():
            forth.publish(String(data=nonce))
            again = now + AGAIN_S
        rclpy.spin_once(node, timeout_sec=0.01)
        return nonce in replies or process.poll() is not None

    wait_until(came, EXCHANGE_S, pause_s=0)
    return nonce in replies, node


if __name__ == "__main__":
    main()
