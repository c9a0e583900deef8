"""Deletes what has expired: jobs, files and results of parts, and parts that were not accepted.

The age of an object is that since it was written last, by the clocks of the store and of this
machine: some hours too many or too few do not matter here. Every instance does this; what another
has deleted is not missed.
"""

import time
from datetime import UTC, datetime, timedelta

from service.engine.mesh.mesh import ENGINE
from service.jobs.files import JobFiles
from service.jobs.keys import (
    CALLERS,
    FILES,
    INTAKE,
    JOBS,
    PARTS,
    manifest_key,
    owner_key,
    state_key,
)
from service.jobs.manifest import Manifest, decode_manifest
from service.jobs.state import decode_state
from service.storage.backends import Entry

UNFINISHED_SECONDS = 86400.0
"""Age after which what a killed process has left counts as unfinished: more than a request takes
to send the parts of a job."""

GRACE = timedelta(hours=1)
"""Time from the moment from which clients do not see an expired job any more to its deletion: a
request for it may just be running."""


async def delete_expired(files: JobFiles, lifetime: float) -> None:
    """Deletes all that has expired.

    A part lives for two lifetimes after it was written last. A job that finds it, after half a
    lifetime, writes it again; so a part lives longer than every job that has it. The same holds for
    the files that parts read.
    """
    now = time.time()
    jobs: set[str] = set()
    folders: set[str] = set()
    for id, modified in await _list_jobs(files):
        manifest = await _manifest(files, id)
        if await _has_expired(files, id, manifest, now - modified, lifetime):
            await _delete_job(files, id, manifest)
            continue
        jobs.add(id)
        if manifest is not None:
            folders.add(manifest.folder)
    async for entry in files.entries(CALLERS):
        if entry.key.rpartition("/")[2] not in jobs:
            await _delete_old(files, entry, now - UNFINISHED_SECONDS)
    async for entry in files.entries(INTAKE):
        if entry.key.split("/")[1] not in folders:
            await _delete_old(files, entry, now - UNFINISHED_SECONDS)
    for prefix in (PARTS, FILES):
        async for entry in files.entries(prefix):
            await _delete_old(files, entry, now - 2 * lifetime)


async def _list_jobs(files: JobFiles) -> list[tuple[str, float]]:
    """The ids of all jobs, and when one of their objects was written last."""
    jobs: dict[str, float] = {}
    async for entry in files.entries(JOBS):
        id = entry.key.split("/")[1]
        jobs[id] = max(entry.modified, jobs.get(id, 0.0))
    return list(jobs.items())


async def _manifest(files: JobFiles, id: str) -> Manifest | None:
    content = await files.read(manifest_key(id))
    return None if content is None else decode_manifest(content)


async def _has_expired(
    files: JobFiles, id: str, manifest: Manifest | None, age: float, lifetime: float
) -> bool:
    if manifest is None:
        return age > UNFINISHED_SECONDS
    content = await files.read(state_key(id))
    state = None if content is None else decode_state(content)
    if state is None or state.ended is None:
        # Only a service that computed the same numbers could go on with it.
        return manifest.engine != ENGINE and age > lifetime
    return state.expires + GRACE < datetime.now(UTC)


async def _delete_job(files: JobFiles, id: str, manifest: Manifest | None) -> None:
    """Deletes a job: the manifest first, so that no process finds half a job."""
    await files.delete(manifest_key(id))
    if manifest is not None:
        await files.delete_all(f"{INTAKE}/{manifest.folder}")
    await files.delete_all(f"{JOBS}/{id}")
    await files.delete(owner_key(id))


async def _delete_old(files: JobFiles, entry: Entry, before: float) -> None:
    if entry.modified < before:
        await files.delete(entry.key)
