"""The progress of a long command on standard error: a bar on a terminal, or a line now and then."""

import shutil
import sys
import time
from collections import deque

from service.cli.refusals import print_error

DRAW_SECONDS, LINE_SECONDS = 0.2, 30.0
"""Seconds between two pictures of the bar, and between two lines elsewhere."""

RATE_SECONDS = 20.0
"""The rate is that of the last seconds, so that the time left follows it."""

BAR_WIDTH = 24


class Progress:
    """Shows how many parts have ended.

    Parameters
    ----------
    total : int or None
        The number of all parts; None if it is unknown.
    """

    def __init__(self, total: int | None) -> None:
        self._total = total
        self._is_terminal = sys.stderr is not None and sys.stderr.isatty()
        self._start = self._shown = time.monotonic()
        self._samples = deque([(self._start, 0)])
        self._width = 0

    @property
    def seconds(self) -> float:
        """Seconds since the start."""
        return time.monotonic() - self._start

    def show(self, ended: int, failed: int) -> None:
        """Shows these numbers of parts, unless others were shown a moment ago."""
        now = time.monotonic()
        if now < self._shown + (DRAW_SECONDS if self._is_terminal else LINE_SECONDS):
            return
        self._shown = now
        self._samples.append((now, ended))
        while len(self._samples) > 2 and self._samples[0][0] < now - RATE_SECONDS:
            self._samples.popleft()
        (before, first), (now, last) = self._samples[0], self._samples[-1]
        text = describe(ended, failed, self._total, (last - first) / max(now - before, 1e-9))
        if self._is_terminal:
            self._draw(_bar(ended, self._total) + text)
        else:
            print_error(text)

    def clear(self) -> None:
        """Clears the line of the bar, so that other lines can follow."""
        if self._width:
            self._draw("")
            self._write("\r")

    def _draw(self, text: str) -> None:
        text = text[: shutil.get_terminal_size().columns - 1]
        self._write("\r" + text.ljust(self._width))
        self._width = len(text)

    def _write(self, text: str) -> None:
        print(text, end="", file=sys.stderr, flush=True)


def _bar(ended: int, total: int | None) -> str:
    if not total:
        return ""
    full = min(BAR_WIDTH, BAR_WIDTH * ended // total)
    return f"[{'#' * full}{'-' * (BAR_WIDTH - full)}] "


def describe(ended: int, failed: int, total: int | None, rate: float) -> str:
    """The numbers as a line: `4,120 of 10,000, 583/s, 11 s left, 1 failed`."""
    facts = [f"{ended:,}" if total is None else f"{ended:,} of {total:,}", f"{rate:,.3g}/s"]
    if total is not None and rate:
        facts.append(f"{describe_seconds((total - ended) / rate)} left")
    if failed:
        facts.append(f"{failed:,} failed")
    return ", ".join(facts)


def describe_seconds(seconds: float) -> str:
    """A time in two units: `9 s`, `2 min 05 s`, `3 h 20 min`."""
    minutes, rest = divmod(round(seconds), 60)
    if not minutes:
        return f"{rest} s"
    hours, minutes = divmod(minutes, 60)
    return f"{hours} h {minutes:02} min" if hours else f"{minutes} min {rest:02} s"
