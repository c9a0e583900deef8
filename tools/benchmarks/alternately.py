"""Timing of rivals in turns, so that whatever else the machine does falls on all of them."""

import time
from collections.abc import Callable, Mapping
from statistics import median


def alternately(
    rivals: Mapping[str, Callable[[], object]],
    rounds: int = 15,
    seconds: float = 0.02,
    clock: Callable[[], float] = time.thread_time,
) -> dict[str, float]:
    """Median CPU seconds of one call of each rival, measured in alternating rounds.

    Every rival runs once unmeasured, then `rounds` times a burst of about `seconds`. The clock is
    that of the thread: time in which another process has the core is not counted. Where the work
    is handed to other threads, it must be that of the process.
    """
    bursts: dict[str, int] = {}
    for name, call in rivals.items():
        call()
        start = clock()
        call()
        once = clock() - start
        bursts[name] = max(1, min(2000, int(seconds / max(once, 1e-6))))
    times: dict[str, list[float]] = {name: [] for name in rivals}
    for _ in range(rounds):
        for name, call in rivals.items():
            start = clock()
            for _ in range(bursts[name]):
                call()
            times[name].append((clock() - start) / bursts[name])
    return {name: median(values) for name, values in times.items()}
