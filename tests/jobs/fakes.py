"""Jobs without processes: an engine that computes in the event loop, and parts made by hand."""

import asyncio
from collections.abc import Callable, Sequence
from contextlib import nullcontext
from dataclasses import asdict, dataclass, field
from errno import ENOSPC
from hashlib import sha256
from typing import Any

import orjson
from obstore.store import MemoryStore

from service.errors import TooLarge
from service.fair.accounts import Accounts
from service.jobs.batch import FAILED, STORE_FAILED, SUCCEEDED, BatchResult, read_task
from service.jobs.checks import CheckedPart
from service.jobs.engine import EngineLost
from service.jobs.keys import part_key
from service.jobs.manager import Jobs
from service.jobs.results import Result, write_error, write_object
from service.jobs.state import JobState, PartResult
from service.settings.values import Settings
from service.storage.backends import Backend, Bucket
from tests.clock import Clock


def make_part(name: str, seconds: float = 0.5, path: str = "/v1/points") -> CheckedPart:
    """A part whose name says what becomes of it: `fail…` fails, `crash…` kills its process."""
    id = sha256(name.encode()).hexdigest()
    line = orjson.dumps({"id": id, "name": name, "path": path})
    return CheckedPart(id, line, seconds, 1000)


def make_parts(prefix: str, count: int, seconds: float = 0.5) -> list[CheckedPart]:
    return [make_part(f"{prefix}{number}", seconds) for number in range(count)]


@dataclass
class FakeEngine:
    """Computes parts at once, or only while `gate` is set; remembers the names in their order.

    Attributes
    ----------
    names : list of str
        The names of the parts that were computed, in their order.
    ends : list of str
        The next tasks end in these ways, without a record.
    clock : Clock, optional
        If given, each task takes a second of this clock.
    stop_after : int
        The number of parts after which the gate closes.
    """

    backend: Backend
    slots: int = 2
    names: list[str] = field(default_factory=list)
    ends: list[str] = field(default_factory=list)
    clock: Clock | None = None
    stop_after: int = -1
    gate: asyncio.Event = field(default_factory=asyncio.Event)
    running: int = 0
    is_closed: bool = False

    async def run(self, task: bytes) -> bytes:
        self.running += 1
        try:
            await self.gate.wait()
            if self.clock is not None:
                self.clock.now += 1.0
            if self.ends:
                return BatchResult((), self.ends.pop(0)).write()
            lines = read_task(task).lines
            if any(line["name"].startswith("crash") for line in lines):
                raise EngineLost
            return BatchResult(tuple([await self._compute(line) for line in lines])).write()
        except OSError as error:
            return BatchResult((), "disk_full" if error.errno == ENOSPC else STORE_FAILED).write()
        finally:
            self.running -= 1
            if len(self.names) == self.stop_after:
                self.gate.clear()

    async def _compute(self, line: dict[str, Any]) -> dict[str, Any]:
        name = line["name"]
        self.names.append(name)
        about = {"part": line["part"], "id": line["id"], "seconds": 0.1}
        if name.startswith("fail"):
            return about | {"state": FAILED, "error": write_error(TooLarge())}
        content = name.encode()
        result = Result("text/plain", "txt", "", len(content), sha256(content).hexdigest())
        await self.backend.write(part_key(line["id"]), write_object(result, content))
        return about | {"state": SUCCEEDED, **asdict(result)}

    async def close(self) -> None:
        self.is_closed = True


class Instance:
    """One serving process's jobs, with a fake engine; `async with` runs them."""

    def __init__(self, backend: Backend | None = None, slots: int = 2, **settings: Any) -> None:
        self.backend = backend or Bucket(MemoryStore())
        self.engine = FakeEngine(self.backend, slots)
        self.engine.gate.set()
        self.accounts = Accounts()
        self.jobs = Jobs(
            "memory://",
            self.backend,
            Settings(**settings),
            self.engine,
            accounts=self.accounts,
            reserve=lambda _: nullcontext(),
        )
        self._task: asyncio.Task[None] | None = None

    async def __aenter__(self) -> "Instance":
        self._task = asyncio.create_task(self.jobs.run())
        return self

    async def __aexit__(self, *_: object) -> None:
        await self.stop()

    async def stop(self) -> None:
        """Ends in order, as the lifespan of the application does."""
        if self._task is not None:
            self._task.cancel()
            await asyncio.gather(self._task, return_exceptions=True)

    async def submit(
        self, parts: Sequence[CheckedPart], caller: str = "a"
    ) -> tuple[JobState, bool]:
        async with self.jobs.start_intake(caller) as intake:
            await intake.add(parts)
            return await intake.finish()

    async def wait(self, id: str) -> JobState:
        """The state at the end of a job."""
        async with asyncio.timeout(20):
            while not (state := await self.jobs.state(id)).has_ended:
                await asyncio.sleep(0.005)
            return state

    async def results(self, id: str, first: int, limit: int) -> Sequence[PartResult]:
        """Parts of a job."""
        return await self.jobs.results(await self.jobs.state(id), first, limit)

    async def content(self, id: str, part: int) -> tuple[Result, memoryview]:
        """The result of a part, and its bytes."""
        (found,) = await self.results(id, part, 1)
        return await self.jobs.content(id, found)


async def until(condition: Callable[[], bool]) -> None:
    """Waits until a condition is true."""
    async with asyncio.timeout(20):
        while not condition():
            await asyncio.sleep(0.01)
