"""The work of the workers of a Dask cluster: `dask worker … --preload service.jobs.dask_worker`.

Only bytes travel. A task is the version and engine that it needs, a line feed, and the task of
`run_batch`; its answer is the result of `run_batch`, or a text that says why there is none. So
nothing of this service is pickled but the name of `run_task`.
"""

import logging
import time

from distributed import Worker, get_worker

from service import __version__
from service.engine.mesh.mesh import ENGINE
from service.jobs.batch import run_batch
from service.settings.runtime import (
    collect_rarely,
    half_of_memory,
    limit_plans,
    pin_blas,
    share_heap,
)

VERSION = f"version {__version__} and engine {ENGINE}"
"""The versions that a worker must have to compute the tasks of this version."""

REFUSED, FAILED = b"refused: ", b"failed: "
"""First letters of an answer that has no result."""

REFUSAL_SECONDS = 1.0
"""Seconds before a worker refuses a task. If it refused at once, it would always be idle, and Dask
would give it nearly all tasks."""

_log = logging.getLogger(__name__)


def dask_setup(worker: Worker) -> None:
    """Sets up the process as the service does; Dask calls this when a worker starts."""
    pin_blas()
    share_heap()
    collect_rarely()
    limit_plans(half_of_memory())
    _log.info("The worker %s has %s", worker.address, VERSION)


def run_task(task: bytes) -> bytes:
    """Computes a batch of parts; a worker of another version or engine refuses it."""
    needed, _, batch = task.partition(b"\n")
    if needed != VERSION.encode():
        time.sleep(REFUSAL_SECONDS)
        text = f"the worker {get_worker().address} has {VERSION}, the job needs "
        return REFUSED + text.encode() + needed
    try:
        return run_batch(batch)
    except Exception as error:
        _log.exception("A batch failed")
        text = f"the worker {get_worker().address}: {type(error).__name__}: {error}"
        return FAILED + text.encode()
