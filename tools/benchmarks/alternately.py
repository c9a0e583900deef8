"""Measures the times of functions alternately, so that other load of the machine slows all of them
equally."""

import time
from collections.abc import Callable, Mapping
from statistics import median


def measure_alternately(
    functions: Mapping[str, Callable[[], object]],
    rounds: int = 15,
    seconds: float = 0.02,
    clock: Callable[[], float] = time.thread_time,
) -> dict[str, float]:
    """Median CPU seconds of one call of each function, by name.

    Every function is called twice before the first round; the second time shows how many calls take
    about `seconds`. Each round has this number of calls, at most 2000. The default clock counts the
    CPU time of this thread only. For work in several threads, `clock` must count the CPU time of
    the process.
    """
    repeats: dict[str, int] = {}
    for name, call in functions.items():
        call()
        start = clock()
        call()
        once = clock() - start
        repeats[name] = max(1, min(2000, int(seconds / max(once, 1e-6))))
    times: dict[str, list[float]] = {name: [] for name in functions}
    for _ in range(rounds):
        for name, call in functions.items():
            start = clock()
            for _ in range(repeats[name]):
                call()
            times[name].append((clock() - start) / repeats[name])
    return {name: median(values) for name, values in times.items()}
