"""Takes from this process what reading a file does not need; there is no way back.

A file comes from a stranger. Should a reader have a fault that lets the file take over the process,
there must be nothing to gain: no files, no network, no other programs, little memory and time.
"""

import ctypes
import math
import os
import platform
import signal
import struct
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

if sys.platform != "win32":
    import resource

NICENESS = 10
"""How much lower than that of the service the priority is (nice(2))."""

_SET_NO_NEW_PRIVILEGES, _SET_SECCOMP, _FILTER_MODE = 38, 22, 2
"""Numbers of prctl(2): from linux/prctl.h and linux/seccomp.h."""

_ALLOW, _REFUSE = 0x7FFF_0000, 0x0005_0001
"""Answers of a filter: allow the call; let it fail with the error 1 (EPERM)."""

_LOAD, _IF_EQUAL, _IF_BITS, _RETURN = 0x20, 0x15, 0x45, 0x06
"""Instructions of a filter, from linux/bpf_common.h: load a word, compare it, end."""

_CALL, _ARCHITECTURE, _PROTECTION = 0, 4, 32
"""Offsets in `struct seccomp_data`: number of the call, architecture, and third argument, which is
the protection of memory for mmap(2) and mprotect(2)."""

_EXECUTABLE = 4
"""The bit of a protection that lets memory hold code (PROT_EXEC)."""

ARCHITECTURES = {"x86_64": (0, 0xC000_003E), "aarch64": (1, 0xC000_00B7)}
"""For each architecture its place in the pairs below, and its number in linux/audit.h."""

_MEMORY_CALLS = {"mmap": (9, 222), "mprotect": (10, 226)}
"""Numbers of the system calls that are allowed unless memory is to hold code."""

_CALLS = {
    **{"read": (0, 63), "write": (1, 64), "close": (3, 57), "fstat": (5, 80), "lseek": (8, 62)},
    **{"munmap": (11, 215), "mremap": (25, 216), "madvise": (28, 233), "brk": (12, 214)},
    **{"rt_sigaction": (13, 134), "rt_sigprocmask": (14, 135), "rt_sigreturn": (15, 139)},
    **{"sigaltstack": (131, 132), "restart_syscall": (219, 128), "sched_yield": (24, 124)},
    **{"exit": (60, 93), "exit_group": (231, 94), "getpid": (39, 172), "gettid": (186, 178)},
    **{"futex": (202, 98), "membarrier": (324, 283), "getrandom": (318, 278)},
    **{"clock_gettime": (228, 113), "gettimeofday": (96, 169), "clock_nanosleep": (230, 115)},
    **{"getrusage": (98, 165), "times": (100, 153), "nanosleep": (35, 101)},
    "setitimer": (38, 103),
}
"""Numbers of the other system calls that stay allowed: to use memory and open pipes, and to read
the clock; a timer may end the process. From linux/arch/x86/entry/syscalls/syscall_64.tbl and
asm-generic/unistd.h."""


_limited: set[str] = set()
"""Has "time" once the processor time of this process is limited."""


def lower_priority() -> None:
    """Lets the service and its other requests go first."""
    with suppress(OSError, AttributeError):  # Windows has neither, macOS no policies
        os.nice(NICENESS)
        os.sched_setscheduler(0, os.SCHED_BATCH, os.sched_param(0))


def limit_resources(memory: int, seconds: float) -> None:
    """Bounds memory and time of this process; it can no longer write files or start processes.

    Parameters
    ----------
    memory : int
        Bytes beside those that the process has now. macOS does not enforce it.
    seconds : float
        Seconds of processor time, beside those used so far. After them a signal ends the process:
        SIGPROF, or a second later SIGXCPU.
    """
    if sys.platform == "win32":
        return
    used = resource.getrusage(resource.RUSAGE_SELF)
    cpu_seconds = math.ceil(used.ru_utime + used.ru_stime + seconds) + 1
    signal.setitimer(signal.ITIMER_PROF, seconds)
    _limited.add("time")
    for name, limit in (
        ("RLIMIT_AS", _address_space() + memory),
        ("RLIMIT_CPU", cpu_seconds),
        ("RLIMIT_FSIZE", 0),
        ("RLIMIT_CORE", 0),
        ("RLIMIT_NPROC", 0),
        ("RLIMIT_NOFILE", 0),
    ):
        number = getattr(resource, name, None)
        if number is None:
            continue
        _, highest = resource.getrlimit(number)
        allowed = limit if highest == resource.RLIM_INFINITY else min(limit, highest)
        with suppress(OSError, ValueError):  # macOS refuses some
            resource.setrlimit(number, (allowed, highest if name == "RLIMIT_CPU" else allowed))


@contextmanager
def limit_step(seconds: float) -> Iterator[None]:
    """Bounds the processor time of the `with` block, in a process whose time is limited.

    Elsewhere, as in tests, it does nothing.
    """
    if sys.platform == "win32" or not _limited:
        yield
        return
    left, _ = signal.setitimer(signal.ITIMER_PROF, seconds)
    try:
        yield
    finally:
        unused, _ = signal.setitimer(signal.ITIMER_PROF, 0)
        signal.setitimer(signal.ITIMER_PROF, max(left - (seconds - unused), 1e-3))


def _address_space() -> int:
    """Bytes of the address space of this process; on systems that do not say, a large value."""
    try:
        pages = Path("/proc/self/statm").read_text(encoding="ascii").split()[0]
    except OSError:
        return 1 << 36
    return int(pages) * os.sysconf("SC_PAGE_SIZE")


def refuse_system_calls() -> bool:
    """Lets every system call fail but those in the tables above; whether the system can do that.

    The calls for files, the network, other processes and their memory fail with EPERM, and no new
    memory can hold code. For Linux on x86-64 and on ARM64.

    References
    ----------
    Linux, Documentation/userspace-api/seccomp_filter.rst; seccomp(2), prctl(2).
    """
    if sys.platform != "linux" or platform.machine() not in ARCHITECTURES:
        return False
    instructions = b"".join(_filter(*ARCHITECTURES[platform.machine()]))
    program = ctypes.create_string_buffer(instructions)
    # struct sock_fprog: the number of instructions, and their address.
    head = ctypes.create_string_buffer(
        struct.pack("HP", len(instructions) // 8, ctypes.addressof(program))
    )
    prctl = ctypes.CDLL(None, use_errno=True).prctl
    prctl.argtypes = [ctypes.c_int, *[ctypes.c_ulong] * 4]
    if prctl(_SET_NO_NEW_PRIVILEGES, 1, 0, 0, 0):
        return False
    return not prctl(_SET_SECCOMP, _FILTER_MODE, ctypes.addressof(head), 0, 0)


def _filter(place: int, architecture: int) -> list[bytes]:
    """The instructions of the filter: `struct sock_filter` each.

    A jump skips instructions: the first number if the test holds, the second if it does not.
    """
    calls = [pair[place] for pair in _CALLS.values()]
    first, second = (pair[place] for pair in _MEMORY_CALLS.values())
    return [
        _instruction(_LOAD, _ARCHITECTURE),
        _instruction(_IF_EQUAL, architecture, 1, 0),
        _instruction(_RETURN, _REFUSE),
        _instruction(_LOAD, _CALL),
        *(
            _instruction(_IF_EQUAL, call, len(calls) - number + 4, 0)
            for number, call in enumerate(calls, 1)
        ),
        _instruction(_IF_EQUAL, first, 1, 0),
        _instruction(_IF_EQUAL, second, 0, 3),
        _instruction(_LOAD, _PROTECTION),
        _instruction(_IF_BITS, _EXECUTABLE, 1, 0),
        _instruction(_RETURN, _ALLOW),
        _instruction(_RETURN, _REFUSE),
    ]


def _instruction(code: int, value: int, if_true: int = 0, if_false: int = 0) -> bytes:
    return struct.pack("=HBBI", code, if_true, if_false, value)
