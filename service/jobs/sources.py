"""The files that parts read, in the store of the jobs, under their hashes.

A client stores a file before it asks for the job. The file stays for two lifetimes of a job after
it was written last; a job that names it after half a lifetime writes it again. So it is there for
as long as the job may be computed.
"""

import asyncio
import time
from hashlib import sha256

from service.decoders.format import Decoder
from service.jobs.file_parts import unknown_file
from service.jobs.files import JobFiles
from service.jobs.keys import file_key
from service.jobs.usage import JobUsage


class SourceFiles:
    """Stores and finds files that parts read.

    Parameters
    ----------
    lifetime : float
        Seconds for which the results of a job are kept.
    """

    def __init__(self, files: JobFiles, usage: JobUsage, lifetime: float) -> None:
        self._files = files
        self._usage = usage
        self._lifetime = lifetime

    async def store(self, content: bytes, decoder: Decoder) -> tuple[str, bool]:
        """Stores a file; returns its id, and whether it is new.

        Raises
        ------
        JobQuotaFull, StoreFull, StoreFailed
        """
        digest = await asyncio.to_thread(lambda: sha256(content).hexdigest())
        id = f"{digest}.{decoder.name}"
        if await self._find(id) is not None:
            return id, False
        await self._usage.check_room(len(content))
        await self._files.write(file_key(id), content, durable=True)
        self._usage.add(len(content))
        return id, True

    async def find_size(self, id: str) -> int:
        """The bytes of a file, which a job is about to need.

        Raises
        ------
        InvalidRequest
            There is no such file; the pointer is `/file`.
        StoreFailed
        """
        size = await self._find(id)
        if size is None:
            raise unknown_file()
        return size

    async def _find(self, id: str) -> int | None:
        """The bytes of a file, which gets younger if it is old; None if there is none."""
        key = file_key(id)
        entry = await self._files.entry(key)
        if entry is None:
            return None
        if time.time() - entry.modified > self._lifetime / 2:
            content = await self._files.read(key)
            if content is None:
                return None
            await self._files.write(key, content, durable=True)
        return entry.size
