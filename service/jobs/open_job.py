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
    done : dict
        For each batch that has ended, how many of its parts have succeeded, and failed.
    waiting, running : set of int
        The batches that wait for a process, and those that run.
    started, ended : datetime or None
    is_cancelled : bool
        Whether nobody waits for it; it ends when no batch runs.
    is_ending : bool
        Whether its end is being stored.
    is_saved : bool
        Whether the store has its present state.
    """

    manifest: Manifest
    lifetime: float
    askers: list[str]
    done: dict[int, tuple[int, int]] = field(default_factory=dict)
    waiting: set[int] = field(default_factory=set)
    running: set[int] = field(default_factory=set)
    started: datetime | None = None
    ended: datetime | None = None
    is_cancelled: bool = False
    is_ending: bool = False
    is_saved: bool = False
    rate: Rate = field(default_factory=Rate)

    @property
    def id(self) -> str:
        """The id of the job."""
        return self.manifest.id

    @property
    def caller(self) -> str:
        """The one whose turn its batches take."""
        return self.askers[0]

    def missing(self) -> list[int]:
        """The batches that have not ended, do not run, and do not wait yet."""
        numbers = range(len(self.manifest.batches))
        others = self.done.keys() | self.waiting | self.running
        return [number for number in numbers if number not in others]

    @property
    def is_over(self) -> bool:
        """Whether no batch has to run any more, and none runs."""
        is_done = len(self.done) == len(self.manifest.batches)
        return not self.running and (is_done or self.is_cancelled)

    def begin(self, number: int) -> None:
        """A batch begins to run."""
        if self.started is None:
            self.started = datetime.now(UTC)
        if not self.running:
            self.rate.add(0)
        self.running.add(number)
        self.is_saved = False

    def end(self, number: int, succeeded: int, failed: int) -> None:
        """A batch has ended, with a record of each part."""
        self.done[number] = succeeded, failed
        self.rate.add(succeeded + failed)
        self.is_saved = False

    def state(self, waiting_for: str = "") -> JobState:
        """The state of the job; `waiting_for` as there."""
        manifest = self.manifest
        succeeded = sum(done[0] for done in self.done.values())
        failed = sum(done[1] for done in self.done.values())
        running = sum(manifest.batches[number].parts for number in self.running)
        rest = manifest.total - succeeded - failed
        name = self._state_name(failed)
        rate = 0.0 if self.ended else round(self.rate.per_second(), 3)
        return JobState(
            id=self.id,
            state=name,
            engine=manifest.engine,
            total=manifest.total,
            queued=rest - running,
            running=running,
            succeeded=succeeded,
            failed=failed,
            created=manifest.created,
            started=self.started,
            ended=self.ended,
            expires=(self.ended or manifest.created) + timedelta(seconds=self.lifetime),
            rate=rate,
            seconds_left=None if self.is_cancelled else seconds_left(rest, rate),
            waiting_for="" if self.ended else waiting_for,
        )

    def _state_name(self, failed: int) -> StateName:
        if len(self.done) == len(self.manifest.batches):
            if self.ended is None:
                return "running"  # until the store has the end
            return "failed" if failed else "succeeded"
        if self.is_cancelled:
            return "cancelled"
        return "running" if self.started else "queued"
