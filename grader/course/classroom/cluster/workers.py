"""Runs on the workers of a Dask cluster: what the dispatcher calls there."""

from __future__ import annotations

import asyncio
import socket

from distributed import Worker, get_worker

from grader.course.classroom.messages import GradingJob, pack_message, unpack_message
from grader.course.classroom.receiving import UnwantedError, answer, fitness
from grader.runtime.model.errors import HarnessError

#: Keys of a progress event.
NAME, STEP = "name", "step"
_UNWANTED = ("cancelled", "released", "forgotten")


async def inspect_worker(isolation: str, dask_worker: Worker) -> bytes:
    """Report whether this worker can grade, as a packed `Fitness`; Dask supplies it because of the parameter's name."""
    return pack_message(await asyncio.to_thread(fitness, isolation, _machine(dask_worker)))


def grade_packed_job(version: str, terms: bytes, job: bytes, topic: str) -> bytes:
    """Grade a submission, and return a packed `JobResult`.

    The version is that of the requesting machine, terms and job are packed, and events of progress go to the topic.
    """
    worker = get_worker()
    key = worker.get_current_task()

    def on_step(step: str) -> None:
        task = worker.state.tasks.get(key)
        if task is None or task.state in _UNWANTED:
            raise UnwantedError
        try:
            name = unpack_message(job, GradingJob).name
        except HarnessError:
            return
        worker.log_event(topic, {NAME: name, STEP: step})

    try:
        return answer(version, terms, job, _machine(worker), on_step)
    except UnwantedError:
        return b""


def _machine(worker: Worker) -> str:
    return f"worker {worker.address} on {socket.gethostname()}"
