"""Calls a function for a file in a forked process: crashes and hangs cost this file alone."""

import json
import os
import signal
import traceback
from collections.abc import Callable
from typing import Any


def call_apart(
    function: Callable[[str], dict[str, Any]], path: str, seconds: int
) -> dict[str, Any]:
    """The result of a function, which JSON can hold; or `fault`, the reason why there is none."""
    source, target = os.pipe()
    process = os.fork()
    if process == 0:
        silence = os.open(os.devnull, os.O_WRONLY)
        os.dup2(silence, 1)
        os.dup2(silence, 2)
        signal.alarm(seconds)
        try:
            result = function(path)
        except Exception:  # the fault of a reader is a result
            result = {"fault": " ".join(traceback.format_exc().splitlines()[-4:])}
        with os.fdopen(target, "w") as stream:
            json.dump(result, stream)
        os._exit(0)
    os.close(target)
    with os.fdopen(source) as stream:
        text = stream.read()
    status = os.waitpid(process, 0)[1]
    return json.loads(text) if text else {"fault": f"ended with status {status}"}
