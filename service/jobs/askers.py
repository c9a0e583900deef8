"""Those who wait for a job: keys by their names, or addresses."""

from datetime import UTC, datetime

import orjson

from service.jobs.files import JobFiles
from service.jobs.keys import (
    CALLERS,
    JOBS,
    OWNERS,
    asker_key,
    caller_hash,
    caller_key,
    cancelled_key,
)


class Askers:
    """Those who wait for each job, and the jobs of each of them."""

    def __init__(self, files: JobFiles) -> None:
        self._files = files

    async def add(self, id: str, caller: str) -> None:
        """Lets a caller wait for a job; is on the disk when this returns."""
        if not await self._files.has(asker_key(id, caller)):
            content = orjson.dumps({"caller": caller, "since": datetime.now(UTC)})
            await self._files.write(asker_key(id, caller), content, durable=True)
        await self._files.write(caller_key(caller, id), b"")

    async def remove(self, id: str, caller: str) -> None:
        """Lets a caller wait no longer; the job of the last one stays in its list."""
        await self._files.delete(asker_key(id, caller))
        if await self.of(id):
            await self._files.delete(caller_key(caller, id))

    async def of(self, id: str) -> list[str]:
        """Those who wait for a job, in the order in which they came."""
        askers = []
        async for entry in self._files.entries(f"{JOBS}/{id}/askers"):
            if content := await self._files.read(entry.key):
                asker = orjson.loads(content)
                askers.append((asker["since"], asker["caller"]))
        return [caller for _, caller in sorted(askers)]

    async def mark_cancelled(self, id: str) -> None:
        """Tells all processes that no caller waits for a job, unless one does."""
        if not await self.of(id):
            await self._files.write(cancelled_key(id), b"", durable=True)
            if await self.of(id):  # a caller has come meanwhile
                await self.unmark_cancelled(id)

    async def unmark_cancelled(self, id: str) -> None:
        """Tells all processes that a caller waits for a job again."""
        await self._files.delete(cancelled_key(id))

    async def jobs_of(self, caller: str | None) -> set[str]:
        """The ids of the jobs of a caller, or of all callers if it is None."""
        prefix = CALLERS if caller is None else f"{CALLERS}/{caller_hash(caller)}"
        return set(await self._files.names(prefix))

    async def count_open(self, caller: str) -> int:
        """How many jobs of a caller have not ended."""
        ids = await self.jobs_of(caller)
        return len(ids.intersection(await self._files.names(OWNERS))) if ids else 0
