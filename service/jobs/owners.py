"""Which process works on which job, and which of these processes are gone.

An *instance* is a serving process. It writes a sign of life, `instances/<id>`, every 10 s, and
`owners/<job>` once for each job that it accepts or takes over; so it writes as often whether it has
one job or a thousand. Another instance takes a job over

- at once, if the sign of life of its owner is not there: the owner has stopped in order;
- at once, if the owner was a process of this host that is gone;
- otherwise if the sign of life has not changed for 60 s of the observer's own clock. No clocks of
  two machines are compared.

Two instances may take over the same job; the one whose name is in `owners/<job>` goes on, and the
other drops the job when it looks next. Meanwhile both compute the same parts, and write the same
bytes.
"""

import asyncio
import os
import socket
import time
import uuid
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

import orjson

from service.jobs.files import JobFiles
from service.jobs.keys import INSTANCES, OWNERS, instance_key, owner_key

BEAT_SECONDS = 10.0
"""Seconds between two signs of life."""

GONE_AFTER = 60.0
"""Seconds without a new sign of life after which an instance counts as gone."""


@dataclass(slots=True)
class _Sighting:
    """The last sign of life that was seen of an instance; `since` is a time of our clock."""

    modified: float
    since: float
    is_dead_here: bool


class Owners:
    """The owners of all jobs, as this instance sees them.

    Attributes
    ----------
    instance : str
        The id of this instance.
    """

    def __init__(self, files: JobFiles) -> None:
        self.instance = uuid.uuid4().hex
        self._files = files
        self._is_alive = False
        self._beating: asyncio.Task[None] | None = None
        self._sightings: dict[str, _Sighting] = {}
        # By job: when its record was written, and the instance that it names.
        self._owners: dict[str, tuple[float, str]] = {}

    async def beat(self) -> None:
        """Gives a sign of life."""
        content = {"host": socket.gethostname(), "pid": os.getpid(), "started": _start(os.getpid())}
        write = self._files.write(instance_key(self.instance), orjson.dumps(content))
        self._beating = asyncio.create_task(write)
        # If this is cancelled, the store writes the sign all the same: `leave` waits for that.
        await asyncio.shield(self._beating)
        self._is_alive = True

    async def take(self, job: str) -> None:
        """Makes this instance the owner of a job; is on the disk when this returns."""
        if not self._is_alive:
            await self.beat()
        await self._files.write(owner_key(job), self.instance.encode("ascii"), durable=True)

    async def release(self, job: str) -> None:
        """Leaves a job without an owner, because it has ended."""
        if await self.owner_of(job) == self.instance:
            await self._files.delete(owner_key(job))

    async def owner_of(self, job: str) -> str | None:
        """The instance that works on a job, as of now; None if none does."""
        content = await self._files.read(owner_key(job))
        return None if content is None else content.decode("ascii", "replace")

    async def leave(self) -> None:
        """Removes the sign of life, so that others take over the jobs of this instance at once."""
        if self._beating is not None:
            await asyncio.wait({self._beating}, timeout=BEAT_SECONDS)
        await self._files.delete(instance_key(self.instance))

    async def look(self) -> dict[str, str]:
        """The owner of each job that has one; `is_gone` then knows these instances."""
        # The list of signs is made after that of owners: each owner has given one before.
        await self._read_owners()
        await self._read_signs()
        return {job: instance for job, (_, instance) in self._owners.items()}

    def is_gone(self, instance: str | None) -> bool:
        """Whether an owner was gone at the last look; None stands for no owner."""
        if instance is None:
            return True
        if instance == self.instance:
            return False
        sighting = self._sightings.get(instance)
        if sighting is None or sighting.is_dead_here:
            return True
        return time.monotonic() - sighting.since > GONE_AFTER

    async def is_gone_now(self, instance: str | None) -> bool:
        """Whether an owner is gone; of one that no look has seen yet, whether it gives no sign."""
        if instance is None or instance == self.instance or instance in self._sightings:
            return self.is_gone(instance)
        return not await self._files.has(instance_key(instance))

    async def forget_gone(self) -> None:
        """Removes the signs of life of instances that are gone."""
        for instance in [name for name in self._sightings if self.is_gone(name)]:
            await self._files.delete(instance_key(instance))

    async def _read_owners(self) -> None:
        owners: dict[str, tuple[float, str]] = {}
        async for entry in self._files.entries(OWNERS):
            job = entry.key.rpartition("/")[2]
            known = self._owners.get(job)
            if known is not None and known[0] == entry.modified:
                owners[job] = known
            elif (content := await self._files.read(entry.key)) is not None:
                owners[job] = entry.modified, content.decode("ascii", "replace")
        self._owners = owners

    async def _read_signs(self) -> None:
        now = time.monotonic()
        sightings: dict[str, _Sighting] = {}
        async for entry in self._files.entries(INSTANCES):
            instance = entry.key.rpartition("/")[2]
            sighting = self._sightings.get(instance)
            if sighting is None or sighting.modified != entry.modified:
                sighting = _Sighting(entry.modified, now, False)
            if instance != self.instance:
                content = await self._files.read(entry.key)
                sighting.is_dead_here = content is not None and _is_dead_here(content)
            sightings[instance] = sighting
        self._sightings = sightings


def _is_dead_here(sign: bytes) -> bool:
    """Whether a sign of life is of a process of this host that is gone.

    A process that has the same number, but started at another time, is another one: in a container
    that is started again, the service mostly has the number 1.
    """
    try:
        content = orjson.loads(sign)
    except ValueError:  # damaged by a power failure, which has ended its process
        return True
    if content["host"] != socket.gethostname():
        return False
    with suppress(PermissionError):
        try:
            os.kill(content["pid"], 0)
        except ProcessLookupError:
            return True
    return bool(_start(content["pid"]) != content["started"])


def _start(pid: int) -> str:
    """When a process started, in ticks since the start of the system (proc_pid_stat(5), field 22).

    Empty if the system does not have this file, or if there is no such process.
    """
    try:
        text = Path(f"/proc/{pid}/stat").read_text(encoding="utf-8", errors="replace")
    except OSError:
        return ""
    return text.rpartition(")")[2].split()[19]
