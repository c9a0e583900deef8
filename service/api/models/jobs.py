"""Models of JSON responses about jobs."""

from datetime import datetime
from typing import Annotated, Literal, TypeAlias

from pydantic import Field

from service.api.models.meshes import Count, Missing, ResponseModel
from service.api.models.surfaces import Problem
from service.schemas.jobs import FILE_ID_PATTERN

State: TypeAlias = Literal["queued", "running", "succeeded", "failed", "cancelled"]
Time: TypeAlias = Annotated[datetime, Field(examples=["2026-11-29T14:40:20.125Z"])]
Sha256: TypeAlias = Annotated[str, Field(pattern="^[0-9a-f]{64}$")]


class PartCounts(ResponseModel):
    """Numbers of parts by their state."""

    total: Annotated[int, Field(ge=1)]
    """All parts."""
    queued: Count
    """Parts that wait, and in a job without askers those that were not computed."""
    running: Count
    """Parts of batches that are computed now."""
    succeeded: Count
    """Parts whose results are ready."""
    failed: Count
    """Parts that were refused or ran out of time."""


class JobLinks(ResponseModel):
    """URLs of a job, without the host."""

    self: str
    """The state."""
    events: str
    """The state as a stream of events, until the job has ended."""
    results: str
    """The list of the results."""


class Job(ResponseModel):
    """The state of a job."""

    id: Sha256
    """The hash of the ids of its parts: the same parts are the same job."""
    state: State
    """`succeeded`: all parts did. `failed`: all have ended, and at least one failed. `cancelled`:
    no caller waits for it."""
    engine: int
    """Version of the numbers with which it is computed."""
    parts: PartCounts
    created: Time
    """When it was accepted first."""
    started: Time | None
    """When its first part began; null before."""
    ended: Time | None
    """When its last part ended; null before."""
    expires: Time
    """When its results are deleted, or while it runs the earliest time of that."""
    rate: Annotated[float, Field(ge=0)]
    """Parts a second lately; 0 if none has ended lately."""
    seconds_left: Count | None
    """The remaining parts divided by `rate`; null if the rate is 0."""
    waiting_for: str | Missing = None
    """Only while the job waits for more than its turn: the code of what it waits for, such as
    `disk_full`. It goes on by itself."""
    links: JobLinks


class JobList(ResponseModel):
    """Jobs of a caller."""

    jobs: list[Job]
    """The jobs, the newest first."""


class JobFile(ResponseModel):
    """A file for parts of jobs."""

    id: Annotated[str, Field(pattern=FILE_ID_PATTERN)]
    """For the `file` of parts: the hash of its bytes, and the name of its format."""
    bytes: Count
    """Its bytes."""


class JobResult(ResponseModel):
    """One part of a job: its state, and its file or its error."""

    part: Count
    """Index of the part."""
    name: str
    """The name that the part was given; without one, its index."""
    state: State
    """As the states of a job."""
    media_type: str | Missing = None
    """Media type of the file. This field and the next three only if the part has succeeded."""
    bytes: Count | Missing = None
    """Bytes of the file."""
    sha256: Sha256 | Missing = None
    """Hash of the file."""
    link: str | Missing = None
    """URL of the file, without the host."""
    problem: Problem | Missing = None
    """The error of a part that failed, as its call would return it. Its pointers are those of the
    job: `/parts/3/body/…`."""


class JobResults(ResponseModel):
    """A range of a job's results."""

    results: list[JobResult]
    """The parts of the range, in their order."""
    next: str | Missing = None
    """URL of the next range, without the host; left out in the last."""
