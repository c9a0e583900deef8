"""Jobs in memory, which compute nothing until a test lets parts end: in place of `Jobs`."""

import asyncio
from collections.abc import AsyncGenerator, Sequence
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from hashlib import sha256
from types import SimpleNamespace
from typing import Any, Self

import orjson
from obstore.store import MemoryStore

from service.engine.mesh.mesh import ENGINE
from service.errors import SurfaceError
from service.jobs.checks import CheckedPart
from service.jobs.files import JobFiles
from service.jobs.reading import file_of, unknown_job
from service.jobs.results import Result
from service.jobs.sources import SourceFiles
from service.jobs.state import JobState, PartResult, StateName
from service.jobs.usage import JobUsage
from service.storage.backends import Bucket

CREATED = datetime(2026, 11, 29, 14, 40, 20, 125_000, UTC)


class FakeJobs:
    """The interface of `service.jobs.manager.Jobs`.

    Attributes
    ----------
    sources : SourceFiles
        Real, in memory.
    states : dict
        The states by id.
    askers : dict
        The callers that wait for a job, by id.
    discarded, read_count, state_count : int
        The number of intakes that were left without `finish`, of results that were read, and of
        calls of `state`.
    batches : list of int
        The number of parts in each call of `add`.
    """

    # For metrics.
    open_jobs = ()
    usage = SimpleNamespace(used=0, quota=0)
    dispatcher = SimpleNamespace(parts={}, seconds=0.0, busy_count=0, waiting_for="")

    def __init__(self) -> None:
        files = JobFiles(Bucket(MemoryStore()))
        self.sources = SourceFiles(files, JobUsage(files, 0), lifetime=7 * 86400)
        self.states: dict[str, JobState] = {}
        self.parts: dict[str, list[PartResult]] = {}
        self.contents: dict[tuple[str, int], bytes] = {}
        self.askers: dict[str, set[str]] = {}
        self.discarded = self.read_count = self.state_count = 0
        self.batches: list[int] = []
        self.lines: list[bytes] = []
        self.error: SurfaceError | None = None
        self.changed = asyncio.Event()

    async def run(self) -> None:
        await asyncio.Event().wait()

    def start_intake(self, caller: str) -> "FakeIntake":
        return FakeIntake(self, caller)

    async def state(self, id: str) -> JobState:
        self.state_count += 1
        if id not in self.states:
            raise unknown_job()
        return self.states[id]

    async def watch(self, id: str) -> AsyncGenerator[JobState]:
        while True:
            yield self.states[id]
            if self.states[id].has_ended:
                return
            await self.changed.wait()
            self.changed.clear()

    async def withdraw(self, id: str, caller: str) -> None:
        self.askers[id].discard(caller)
        if not self.askers[id]:
            self.states[id] = replace(self.states[id], state="cancelled")

    async def results(self, state: JobState, first: int, limit: int) -> list[PartResult]:
        return self.parts[state.id][first : first + limit]

    async def content(self, id: str, part: PartResult) -> tuple[Result, memoryview]:
        self.read_count += 1
        return file_of(part), memoryview(self.contents[id, part.part])

    async def list(self, caller: str | None) -> list[JobState]:
        return [s for id, s in self.states.items() if caller is None or caller in self.askers[id]]

    def end_part(self, id: str, part: int, result: bytes | SurfaceError) -> None:
        """Lets a part succeed with these bytes, or fail with this error."""
        old, state = self.parts[id][part], self.states[id]
        if isinstance(result, SurfaceError):
            self.parts[id][part] = replace(old, state="failed", error=result)
        else:
            digest = sha256(result).hexdigest()
            file = Result("model/gltf-binary", "glb", "sail", len(result), digest, 4, 2, 0.5)
            self.parts[id][part] = replace(old, state="succeeded", result=file)
            self.contents[id, part] = result
        names = [each.state for each in self.parts[id]]
        succeeded, failed = names.count("succeeded"), names.count("failed")
        left = state.total - succeeded - failed
        name: StateName = "running" if left else "failed" if failed else "succeeded"
        self.states[id] = replace(
            state,
            state=name,
            queued=left,
            succeeded=succeeded,
            failed=failed,
            ended=None if left else CREATED + timedelta(seconds=2),
        )
        self.changed.set()


class FakeIntake:
    """The interface of `service.jobs.manager.Intake`."""

    def __init__(self, jobs: FakeJobs, caller: str) -> None:
        self._jobs = jobs
        self._caller = caller
        self._parts: list[CheckedPart] = []
        self._is_finished = False

    async def __aenter__(self) -> Self:
        if self._jobs.error is not None:
            raise self._jobs.error
        return self

    async def __aexit__(self, *_: Any) -> None:
        self._jobs.discarded += not self._is_finished

    async def add(self, checked: Sequence[CheckedPart]) -> None:
        self._jobs.batches.append(len(checked))
        self._jobs.lines += [part.line for part in checked]
        self._parts += checked

    async def finish(self) -> tuple[JobState, bool]:
        self._is_finished = True
        jobs, total = self._jobs, len(self._parts)
        id = sha256(bytes.fromhex("".join(part.id for part in self._parts))).hexdigest()
        is_new = id not in jobs.states
        jobs.askers.setdefault(id, set()).add(self._caller)
        if is_new:
            expires = CREATED + timedelta(days=7)
            counts = (total, total, 0, 0, 0)
            jobs.states[id] = JobState(id, "queued", ENGINE, *counts, CREATED, None, None, expires)
            names = [orjson.loads(part.line).get("name", "") for part in self._parts]
            jobs.parts[id] = [
                PartResult(index, part.id, name, "queued")
                for index, (part, name) in enumerate(zip(self._parts, names, strict=True))
            ]
        return jobs.states[id], is_new
