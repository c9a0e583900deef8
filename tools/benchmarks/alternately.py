"""Times rivals alternately, so that other load of the machine slows all of them equally."""

import time
from collections.abc import Callable, Mapping
from statistics import median


def measure_alternately(
    rivals: Mapping[str, Callable[[], object]],
    rounds: int = 15,
    seconds: float = 0.02,
    clock: Callable[[], float] = time.thread_time,
) -> dict[str, float]:
    """Median CPU seconds of one call of each rival, measured in alternating rounds.

    Every rival runs once unmeasured, then in each round for about `seconds`. By default the clock
    counts the CPU time of this thread, so other processes do not count. For work in several
    threads, `clock` must count the CPU time of the process.
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
