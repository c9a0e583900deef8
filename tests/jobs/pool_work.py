"""The work of job processes in tests, in a module that imports little."""

import os
import time


def work(task: bytes) -> bytes:
    """Dies, sleeps, or returns the id and the niceness of the process: in place of `run_batch`."""
    match task.split():
        case [b"die"]:
            os._exit(1)
        case [b"sleep", seconds]:
            time.sleep(float(seconds))
    return b"%d %d" % (os.getpid(), os.nice(0))
