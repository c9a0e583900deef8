"""A job that this instance works on: which batches have ended, run and wait, and how fast."""

import time
from collections import deque
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta

from service.jobs.manifest import Manifest
from service.jobs.state import JobState, StateName, seconds_left

RATE_SECONDS = 30.0
"""The time for which the rate of a job is averaged."""


class Rate:
    """Parts that ended a second, over the last `RATE_SECONDS`."""

    def __init__(self) -> None:
        self._samples: deque[tuple[float, int]] = deque()
        self._count = 0

    def add(self, parts: int) -> None:
        """Counts parts that have ended now; 0 marks the time of the start."""
        self._count += parts
        self._samples.append((time.monotonic(), self._count))

    def per_second(self) -> float:
        """Parts a second; 0 before any has ended."""
        now = time.monotonic()
        while len(self._samples) > 1 and self._samples[1][0] < now - RATE_SECONDS:
            self._samples.popleft()
        if not self._samples:
            return 0.0
        start, count = self._samples[0]
        return (self._count - count) / (now - start) if now > start else 0.0


@dataclass(eq=False, slots=True)
class OpenJob:
    """A job that has not ended.

    Attributes
    ----------
    manifest : Manifest
    lifetime : float
        Seconds for which its results are kept.
    askers : list of str
        Those who wait for it, in the order in which they came. Its work counts for the first.
    done, running : set of int
        The batches that have ended, and those that run.
    succeeded, failed : int
        The parts of the batches that have ended.
    started : datetime or None
    is_cancelled : bool
        Whether no caller waits for it; it ends when no batch runs.
    is_queued : bool
        Whether it waits for its turn.
    is_ending : bool
        Whether its end is being stored.
    is_saved : bool
        Whether the store has its present state.
    """

    manifest: Manifest
    lifetime: float
    askers: list[str]
    done: set[int] = field(default_factory=set)
    running: set[int] = field(default_factory=set)
    succeeded: int = 0
    failed: int = 0
    started: datetime | None = None
    is_cancelled: bool = False
    is_queued: bool = False
    is_ending: bool = False
    is_saved: bool = False
    rate: Rate = field(default_factory=Rate)
    # The batches from this number on have not run yet; those before it that have to run again.
    _next: int = 0
    _again: list[int] = field(default_factory=list)

    @property
    def id(self) -> str:
        """The id of the job."""
        return self.manifest.id

    @property
    def caller(self) -> str:
        """The one whose turn its batches take."""
        return self.askers[0]

    @property
    def has_missing(self) -> bool:
        """Whether batches have neither ended nor run now."""
        return len(self.done) + len(self.running) < len(self.manifest.batches)

    @property
    def is_over(self) -> bool:
        """Whether no batch has to run any more, and none runs."""
        is_done = len(self.done) == len(self.manifest.batches)
        return not self.running and (is_done or self.is_cancelled)

    def begin_next(self) -> int:
        """Begins to run a missing batch; returns its number."""
        if self.started is None:
            self.started = datetime.now(UTC)
        if not self.running:
            self.rate.add(0)
        if self._again:
            number = self._again.pop()
        else:
            while self._next in self.done:
                self._next += 1
            number = self._next
            self._next += 1
        self.running.add(number)
        self.is_saved = False
        return number

    def stop(self, number: int) -> None:
        """A batch has stopped before it has ended, and has to run again."""
        self.running.discard(number)
        self._again.append(number)

    def end(self, number: int, succeeded: int, failed: int) -> None:
        """A batch has ended, with a record of each part."""
        self.running.discard(number)
        self.count(number, succeeded, failed)
        self.rate.add(succeeded + failed)
        self.is_saved = False

    def count(self, number: int, succeeded: int, failed: int) -> None:
        """Counts a batch that has ended."""
        self.done.add(number)
        self.succeeded += succeeded
        self.failed += failed

    def state(self, waiting_for: str = "", ended: datetime | None = None) -> JobState:
        """The state of the job, or that at its end; `waiting_for` as there."""
        manifest = self.manifest
        running = sum(manifest.batches[number].parts for number in self.running)
        rest = manifest.total - self.succeeded - self.failed
        rate = 0.0 if ended else round(self.rate.per_second(), 3)
        return JobState(
            id=self.id,
            state=self._state_name(ended),
            engine=manifest.engine,
            total=manifest.total,
            queued=rest - running,
            running=running,
            succeeded=self.succeeded,
            failed=self.failed,
            created=manifest.created,
            started=self.started,
            ended=ended,
            expires=(ended or manifest.created) + timedelta(seconds=self.lifetime),
            rate=rate,
            seconds_left=None if self.is_cancelled else seconds_left(rest, rate),
            waiting_for="" if ended else waiting_for,
        )

    def _state_name(self, ended: datetime | None) -> StateName:
        if len(self.done) == len(self.manifest.batches):
            if ended is None:
                return "running"  # until the store has the end
            return "failed" if self.failed else "succeeded"
        if self.is_cancelled:
            return "cancelled"
        return "running" if self.started else "queued"
