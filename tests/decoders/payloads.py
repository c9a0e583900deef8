"""A program for a child process that does with a file what no reader would: the file says what.

Tests put its name in the place of `service.decoders.child_processes.PROGRAM`.
"""

import ctypes
import json
import os
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from service.decoders import child_program
from service.decoders.confinement import limit_step
from service.decoders.format import Decoded, Decoder, FileLimits, build_file_error

Tree = dict[str, Any]


def main() -> None:
    decoder = Decoder("step", "", "", (), True, (), _decode, "", 1)
    vars(child_program).update(BY_NAME={"step": decoder}, import_reader=lambda _name: None)
    child_program.main()


def _decode(content: bytes, kind: str | None, limits: FileLimits) -> Decoded:
    task = json.loads(content[:1000].rstrip())
    tree = PAYLOADS[task["do"]](task.get("with"))
    reading: Tree = {"format": "step", "faces": limits.max_faces, "products": len(content)}
    given: Tree = {"type": "brep", "kind": kind} | tree
    return Decoded(given, reading | {"skipped_faces": []} | given.pop("reading", {}))


def _attempt(call: Callable[[], object]) -> str:
    """The name of the error of a call; empty if there is none."""
    try:
        call()
    except Exception as error:
        return type(error).__name__
    return ""


def _try_everything(path: str) -> Tree:
    """Calls that a reader has no right to make; the name of the error of each."""
    libc = ctypes.CDLL(None, use_errno=True)
    calls: dict[str, Callable[[], object]] = {
        "read a file": lambda: Path(path).read_bytes(),
        "write a file": lambda: Path(path + ".new").write_bytes(b"1"),
        "list a folder": lambda: os.listdir("/"),
        "look at a file": lambda: os.stat(path),
        "make a pipe": os.pipe,
        "open a socket": lambda: socket.socket(socket.AF_INET),
        "open a Unix socket": lambda: socket.socket(socket.AF_UNIX),
        "start a program": lambda: subprocess.run(["/bin/true"], check=False),
        "fork": os.fork,
        "start a thread": lambda: threading.Thread(target=int).start(),
        "signal its parent": lambda: os.kill(os.getppid(), 0),
        "import a module": lambda: __import__("wave"),
        "make memory executable": lambda: _map_executable(libc),
        "read the parent's memory": lambda: _ptrace(libc),
    }
    return {name: _attempt(call) for name, call in calls.items()}


def _map_executable(libc: ctypes.CDLL) -> None:
    libc.mmap.restype = ctypes.c_void_p
    private_anonymous, all_rights = 0x22, 7
    if libc.mmap(None, 4096, all_rights, private_anonymous, -1, 0) == ctypes.c_void_p(-1).value:
        raise OSError(ctypes.get_errno(), "mmap")


def _ptrace(libc: ctypes.CDLL) -> None:
    attach = 16
    if libc.ptrace(attach, os.getppid(), None, None):
        raise OSError(ctypes.get_errno(), "ptrace")


def _is_open(descriptor: int) -> bool:
    """Whether zero bytes can be read or written."""
    reading, writing = (lambda: os.read(descriptor, 0)), (lambda: os.write(descriptor, b""))
    return not (_attempt(reading) and _attempt(writing))


def _describe(_: object) -> Tree:
    """The state of the process: descriptors that are open, variables, folder, modules."""
    return {
        "descriptors": [number for number in range(256) if _is_open(number)],
        "variables": dict(os.environ),
        "modules": sorted(sys.modules),
        "threads": threading.active_count(),
    }


def _write_answer(size: int) -> Tree:
    return {"array": np.arange(float(size)), "nothing": None}


def _hang(_: object) -> Tree:
    while True:
        time.sleep(1)


def _compute(_: object) -> Tree:
    while True:
        pass


def _fill_memory(_: object) -> Tree:
    blocks = []
    while True:
        blocks.append(bytes(1 << 20))


def _take_array(size: int) -> Tree:
    return {"array": np.ones(size)}


def _crash(_: object) -> Tree:
    ctypes.string_at(0)
    return {}


def _die(number: int) -> Tree:
    signal.raise_signal(number)
    return {}


def _refuse(_: object) -> Tree:
    raise build_file_error("Nothing can be read.", "a test", "a file")


def _fail(_: object) -> Tree:
    raise LookupError("a fault of the reader")


def _nest(depth: int) -> Tree:
    return {"deep": _nest(depth - 1)} if depth else {}


def _write_raw(text: str) -> Tree:
    """An answer that is not that of the program: frames with their lengths, or other bytes."""
    for line in text.encode().splitlines(keepends=True):
        if line.startswith(b"{"):
            os.write(1, len(line).to_bytes(8, "little"))
        os.write(1, line)
    os._exit(0)


def _write_much(size: int) -> Tree:
    block = bytes(1 << 20)
    for _ in range(size // len(block)):
        view = memoryview(block)
        while view:
            view = view[os.write(1, view) :]
    os._exit(0)


def _close_and_hang(_: object) -> Tree:
    os.close(1)
    return _hang(None)


def _take_step(seconds: tuple[float, float]) -> Tree:
    """Computes in a step that has the first number of seconds, for the second number."""
    with limit_step(seconds[0]):
        end = time.process_time() + seconds[1]
        while time.process_time() < end:
            pass
    left, _ = signal.setitimer(signal.ITIMER_PROF, 1)
    return {"left": left}


def _repeat(tree: Tree) -> Tree:
    """The tree that the file itself has; `reading` in it changes the report."""
    return tree


PAYLOADS: dict[str, Callable[[Any], Tree]] = {
    "try everything": _try_everything,
    "describe": _describe,
    "answer": _write_answer,
    "hang": _hang,
    "compute": _compute,
    "fill memory": _fill_memory,
    "take an array": _take_array,
    "crash": _crash,
    "die": _die,
    "refuse": _refuse,
    "fail": _fail,
    "nest": _nest,
    "repeat": _repeat,
    "step": _take_step,
    "write": _write_raw,
    "write much": _write_much,
    "close and hang": _close_and_hang,
}
