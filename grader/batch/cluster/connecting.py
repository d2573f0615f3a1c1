"""Finds the scheduler of a Dask cluster, and speaks to it for as long as a class is graded."""

from __future__ import annotations

import json
import logging
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from distributed import Client, Security

from grader.batch.cluster.scheduler import ClusterScheduler
from grader.batch.tasks import MakeScheduler
from grader.model.errors import EnvironmentFault

#: Longest wait for a scheduler to answer, and for it to say goodbye.
CONNECT_S = 15.0
_GOODBYE_S = 5.0
_LOGGERS = ("distributed", "distributed.client")


@contextmanager
def connected(
    place: str, jobs: int | None, warn: Callable[[str], None], *, patience_s: float = CONNECT_S
) -> Iterator[MakeScheduler]:
    """Connect to a cluster, and let go of it afterwards.

    Args:
        place: Address of the scheduler, such as `tcp://host:8786`, or a scheduler file.
        jobs: Submissions at a time; None for as many as the cluster has threads.
        warn: Hears why a worker that joined later is not used.
        patience_s: Longest wait for an answer.

    Raises:
        EnvironmentFault: There is no scheduler.
    """
    address = address_of(place)
    if os.environ.get("GRADER_DEBUG") != "1":
        for name in _LOGGERS:
            logging.getLogger(name).setLevel(logging.CRITICAL)  # what an instructor must know, we say ourselves
    client = _client(address, patience_s)
    try:
        yield lambda _: ClusterScheduler(client, jobs, warn)
    finally:
        client.close(timeout=_GOODBYE_S)


def address_of(place: str) -> str:
    """Return the address of a scheduler that was named by it or by its file; raises EnvironmentFault."""
    path = Path(place)
    if ":" in place and not path.is_file():
        return place
    try:
        said = json.loads(path.read_bytes())
        return str(said["address"])
    except OSError as error:
        message = f"--scheduler {place}: expected an address or a scheduler file, found: {error.strerror}"
        raise EnvironmentFault(message, "an address looks like tcp://host:8786") from None
    except (ValueError, KeyError, TypeError, RecursionError):
        message = f"--scheduler {place}: expected a file that `dask scheduler --scheduler-file` wrote, found another"
        raise EnvironmentFault(message, "name the address, such as tcp://host:8786") from None


def _client(address: str, patience_s: float) -> Client:
    if address.startswith("tls://") and Security().get_connection_args("client").get("ssl_context") is None:
        message = f"--scheduler {address}: expected certificates in Dask's configuration, found none"
        raise EnvironmentFault(message, "name them under distributed.comm.tls: ca-file, client.cert, client.key")
    try:
        return Client(address, timeout=patience_s, set_as_default=False, name="grade-batch")
    except (OSError, TimeoutError):
        message = f"--scheduler {address}: expected a Dask scheduler, found none that answers"
        raise EnvironmentFault(
            message, "start it with `dask scheduler`, or look whether a firewall is between"
        ) from None
    except (ValueError, TypeError) as error:
        raise EnvironmentFault(f"--scheduler {address}: expected an address, found: {error}") from None
