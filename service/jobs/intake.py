"""Takes the parts of a job as they come, and writes them to the store in batches.

A batch is about a second of work: long enough that passing it to a process costs little, short
enough that callers take turns and that little is lost with a process.
"""

import uuid
from collections.abc import Iterator, Sequence
from hashlib import sha256

from service.errors import Issue, TooLarge
from service.jobs.batch import BATCH_BYTES, BATCH_PARTS, BATCH_SECONDS
from service.jobs.checks import CheckedPart
from service.jobs.files import JobFiles
from service.jobs.keys import INTAKE, intake_key
from service.jobs.manifest import Batch
from service.jobs.usage import JobUsage

GROWTH = 1000
"""The batches of a job after which the next batches have one more `BATCH_SECONDS` of work. Parts by
tolerance have large estimates: 100,000 of them make 9,000 batches, not 50,000. A batch takes memory
while the job is open, and a file on the disk."""


class PartWriter:
    """Cuts parts into batches and writes these; each is on the disk when `add` returns.

    Attributes
    ----------
    batches : list of Batch
        The batches that were written.
    parts : int
        The number of parts so far.
    folder : str
        The folder in `intake/` that has them.
    """

    def __init__(self, files: JobFiles, usage: JobUsage, max_parts: int) -> None:
        self.batches: list[Batch] = []
        self.parts = 0
        self._files = files
        self._usage = usage
        self.folder = uuid.uuid4().hex
        self._max_parts = max_parts
        self._open: list[CheckedPart] = []
        self._open_seconds = self._open_bytes = 0.0
        self._written = 0
        self._hash = sha256()

    async def add(self, checked: Sequence[CheckedPart]) -> None:
        """Adds parts behind those that were added before.

        Raises
        ------
        TooLarge
            The job has too many parts.
        JobQuotaFull, StoreFull, StoreFailed
        """
        if self.parts + len(checked) > self._max_parts:
            message = "The job has too many parts."
            needed = f"at most {self._max_parts} parts"
            raise TooLarge(Issue("too_many_parts", message, "/parts", "more parts", needed))
        for part in checked:
            if self._open and not self._fits(part):
                await self._write()
            self._open.append(part)
            self._open_seconds += part.seconds
            self._open_bytes += len(part.line)
            self._hash.update(bytes.fromhex(part.id))
            self.parts += 1

    async def delete(self) -> None:
        """Removes all that was written."""
        written, self._written = self._written, 0
        await self._files.delete_all(f"{INTAKE}/{self.folder}")
        self._usage.add(-written)

    async def finish(self) -> str:
        """Writes the last batch; returns the id of the job, the hash of the ids of its parts."""
        if self._open:
            await self._write()
        return self._hash.hexdigest()

    def _fits(self, part: CheckedPart) -> bool:
        """Whether the open batch has room for this part, by its estimated seconds."""
        seconds = BATCH_SECONDS * (1 + len(self.batches) // GROWTH)
        return (
            len(self._open) < BATCH_PARTS
            and self._open_seconds + part.seconds <= seconds
            and self._open_bytes + len(part.line) <= BATCH_BYTES
        )

    async def _write(self) -> None:
        first = self.parts - len(self._open)
        content = b"\n".join(_number_lines(first, self._open))
        memory = max(part.memory for part in self._open)
        key = intake_key(self.folder, len(self.batches))
        await self._usage.check_room(len(content))
        await self._files.write(key, content, durable=True)
        self.batches.append(Batch(first, len(self._open), memory))
        self._usage.add(len(content))
        self._written += len(content)
        self._open.clear()
        self._open_seconds = self._open_bytes = 0.0


def _number_lines(first: int, parts: Sequence[CheckedPart]) -> Iterator[bytes]:
    """The lines of parts, each with its index in the job as the member `part`."""
    for index, part in enumerate(parts, first):
        yield b'{"part":%d,' % index + part.line.removeprefix(b"{")
