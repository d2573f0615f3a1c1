"""The functions that a cluster calls by name on its workers; they take and return bytes, and raise nothing."""

from __future__ import annotations

import asyncio
import socket

from distributed import Worker, get_worker

import grader
from grader.batch.cluster.errands import failure, fitness, fulfil
from grader.batch.parcels import Answer, Errand, Fitness, Terms, pack, unpack
from grader.model.errors import HarnessError

#: What an event about a submission holds.
NAME, STEP = "name", "step"
_UNWANTED = ("cancelled", "released", "forgotten")


class _UnwantedError(Exception):
    """Nobody waits for this submission any more."""


async def inspect(isolation: str, dask_worker: Worker) -> bytes:
    """Return whether this worker can grade.

    Args:
        isolation: The sandbox that was asked for.
        dask_worker: This worker; Dask fills it in by this name.
    """
    return pack(await asyncio.to_thread(_fitness, isolation, _machine(dask_worker)))


def grade(version: str, terms: bytes, errand: bytes, topic: str) -> bytes:
    """Grade a submission.

    Args:
        version: Version of the grader that asks.
        terms: What the class is graded with.
        errand: The submission.
        topic: Where steps are told.
    """
    worker = get_worker()
    machine = _machine(worker)
    if version != grader.__version__:
        return pack(Answer(machine, unfit=other_version(version, grader.__version__), hint=remedy(version)))
    key = worker.get_current_task()

    def hear(step: str) -> None:
        task = worker.state.tasks.get(key)
        if task is None or task.state in _UNWANTED:
            raise _UnwantedError
        worker.log_event(topic, {NAME: what.name, STEP: step})

    try:
        what = unpack(errand, Errand)
        return pack(fulfil(unpack(terms, Terms), what, machine, hear))
    except _UnwantedError:
        return b""
    except HarnessError as error:
        return pack(Answer(machine, unfit=error.message, hint=error.hint))
    except Exception as error:  # the last line of defence: a mistake of ours must not look like a low score
        return pack(failure(machine, f"the grader failed: {type(error).__name__}: {error}"))


def other_version(wanted: str, found: str) -> str:
    """Return what to say of a machine with another version of the grader, or none."""
    return f"expected rclpy-grader {wanted}, found {found or 'none'}"


def remedy(version: str) -> str:
    """Return what mends that."""
    return f"install it there: pip install 'rclpy-grader[dask]=={version}'"


def _fitness(isolation: str, machine: str) -> Fitness:
    try:
        return fitness(isolation, machine)
    except Exception as error:  # whatever it is, this machine is no good, and the others need not suffer for it
        return Fitness(machine, f"the grader failed: {type(error).__name__}: {error}")


def _machine(worker: Worker) -> str:
    return f"worker {worker.address} on {socket.gethostname()}"
