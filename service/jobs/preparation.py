"""The preparation of a job process, before its first task.

This module imports little, so that a process answers a moment after its start; the first task makes
it import what computes.
"""

import multiprocessing
import os
import signal
import sys
from multiprocessing.connection import wait
from threading import Thread

from service.decoders.child_processes import PROCESSES
from service.settings.runtime import collect_rarely, limit_plans, pin_blas, share_heap


def prepare(memory: int, niceness: int) -> None:
    """Prepares a job process, as `create_app` prepares that of the service."""
    # The end of the parent ends this process, so it need not handle signals that both receive.
    for number in (signal.SIGINT, signal.SIGTERM):
        signal.signal(number, signal.SIG_IGN)
    Thread(target=_end_with_parent, daemon=True).start()
    if sys.platform != "win32":
        os.nice(niceness)
    pin_blas()
    share_heap()
    collect_rarely()
    limit_plans(memory)
    PROCESSES.starts_ahead = True


def _end_with_parent() -> None:
    """Waits for the end of the parent process, and ends this one: an executor alone would not."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        wait([parent.sentinel])
    os._exit(1)
