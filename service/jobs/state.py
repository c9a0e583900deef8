"""A job as clients see it: its state, and the results of its parts."""

import math
from dataclasses import dataclass
from datetime import datetime
from typing import Any, Literal, TypeAlias

import orjson

from service.errors import SurfaceError
from service.jobs.results import Result

StateName: TypeAlias = Literal["queued", "running", "succeeded", "failed", "cancelled"]


@dataclass(frozen=True, slots=True)
class JobState:
    """The state of a job at one moment.

    Attributes
    ----------
    id : str
    state : str
        `succeeded`: all parts did; `failed`: all ended, and at least one failed; `cancelled`:
        no caller waits for the job.
    engine : int
        The version of the numbers that the job is computed with.
    total, queued, running, succeeded, failed : int
        Numbers of parts. The parts of a batch that runs are `running` until the batch has ended.
    created, started, ended : datetime
        In UTC; `started` and `ended` are None before.
    expires : datetime
        When the results are deleted; before the job has ended, the earliest time of that.
    rate : float
        Parts a second lately; 0 if none has ended lately.
    seconds_left : int or None
        The remaining parts divided by `rate`.
    waiting_for : str
        The code of what the job waits for, such as `disk_full`; empty if it waits for nothing but
        its turn.
    """

    id: str
    state: StateName
    engine: int
    total: int
    queued: int
    running: int
    succeeded: int
    failed: int
    created: datetime
    started: datetime | None
    ended: datetime | None
    expires: datetime
    rate: float = 0.0
    seconds_left: int | None = None
    waiting_for: str = ""

    @property
    def has_ended(self) -> bool:
        """Whether nothing changes any more, unless a caller asks for the job again."""
        return self.state not in ("queued", "running")

    def encode(self) -> bytes:
        """The state as JSON, for the store."""
        return orjson.dumps(self)


_TIMES = ("created", "started", "ended", "expires")


def decode_state(content: bytes) -> JobState | None:
    """The state that `JobState.encode` wrote; None if a power failure has damaged it."""
    try:
        values: dict[str, Any] = orjson.loads(content)
    except ValueError:
        return None
    times = {name: values[name] and datetime.fromisoformat(values[name]) for name in _TIMES}
    return JobState(**values | times)


def seconds_left(parts: int, rate: float) -> int | None:
    """Seconds until `parts` more parts have ended at this rate; None without a rate."""
    return math.ceil(parts / rate) if rate else None


@dataclass(frozen=True, slots=True)
class PartResult:
    """One part of a job, and its result.

    Attributes
    ----------
    part : int
        The index of the part.
    id : str
        The part's id.
    name : str
        The name that the client gave; empty if it gave none.
    state : str
        As the states of a job.
    result : Result or None
        What is known of the file; None until the part has succeeded.
    error : SurfaceError or None
        Why the part has failed.
    """

    part: int
    id: str
    name: str
    state: StateName
    result: Result | None = None
    error: SurfaceError | None = None
