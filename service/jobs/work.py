"""The jobs that this instance works on: accepted here, or taken over from others.

A client learns of nothing that is not in the store yet. So a process that is killed loses nothing
but the batches that it ran, and another one goes on with its jobs.
"""

import asyncio
import logging
from contextlib import suppress
from datetime import UTC, datetime, timedelta
from weakref import WeakValueDictionary

from service.engine.mesh.mesh import ENGINE
from service.errors import SurfaceError
from service.jobs.askers import Askers
from service.jobs.dispatch import Dispatcher
from service.jobs.files import JobFiles
from service.jobs.intake import PartWriter
from service.jobs.keys import JOBS, cancelled_key, manifest_key, results_key, state_key
from service.jobs.manifest import Manifest
from service.jobs.open_job import OpenJob
from service.jobs.owners import Owners
from service.jobs.reading import JobReader
from service.jobs.state import JobState

_log = logging.getLogger(__name__)


class Work:
    """Accepts, begins, takes over, stores and ends jobs.

    Attributes
    ----------
    open : dict
        The jobs that have not ended and are this instance's, by id.
    stranded : set of str
        Jobs of owners that are gone, which this instance cannot compute: they need another version
        of the numbers.
    """

    def __init__(
        self,
        files: JobFiles,
        reader: JobReader,
        askers: Askers,
        owners: Owners,
        dispatcher: Dispatcher,
    ) -> None:
        self.open: dict[str, OpenJob] = {}
        self.stranded: set[str] = set()
        self._files = files
        self._reader = reader
        self._askers = askers
        self._owners = owners
        self._dispatcher = dispatcher
        dispatcher.on_change = self._on_change
        dispatcher.on_cancelled = self._check_askers
        # Jobs of other instances that clients of this one have asked for.
        self._joined: set[str] = set()
        self._locks: WeakValueDictionary[str, asyncio.Lock] = WeakValueDictionary()
        self._ending: set[asyncio.Task[None]] = set()

    async def accept(self, id: str, caller: str, parts: PartWriter) -> tuple[JobState, bool]:
        """Accepts a job whose parts are written; returns whether it is new."""
        async with self.lock(id):
            manifest = await self._reader.manifest(id)
            if manifest is not None:
                await parts.delete()
                return await self._join(manifest, caller), False
            manifest = Manifest(id, ENGINE, datetime.now(UTC), parts.folder, tuple(parts.batches))
            await self._store_manifest(manifest, caller)
            return await self._begin(OpenJob(manifest, self._reader.lifetime, [caller])), True

    async def withdraw(self, id: str, caller: str) -> None:
        """Lets a caller wait for a job no longer; if no other caller waits for it, it ends."""
        async with self.lock(id):
            await self._askers.remove(id, caller)
            if not (await self._reader.state(id)).has_ended or id in self.open:
                await self._askers.mark_cancelled(id)
            await self._update_askers(id)

    async def look(self) -> None:
        """Takes over jobs of instances that are gone; drops those that others have taken over."""
        mine = set(self.open)
        owners: dict[str, str | None] = dict(await self._owners.look())
        for id in mine:
            if owners.get(id, self._owners.instance) != self._owners.instance:
                self._drop(id)
        joined, self._joined = self._joined, set()
        owners.update((id, None) for id in joined if id not in owners)
        self.stranded.clear()
        for id, owner in owners.items():
            if id not in self.open and self._owners.is_gone(owner):
                await self._take_over(id, owner)
        await self._owners.forget_gone()

    async def save(self) -> None:
        """Stores states that have changed, and looks whether jobs that run are withdrawn."""
        self._dispatcher.start_queued()
        for job in tuple(self.open.values()):
            async with self.lock(job.id):  # so that this state does not replace that of the end
                if self.open.get(job.id) is not job:
                    continue
                if not job.is_saved:
                    await self._save_state(job)
            if job.running:
                await self.look_for_withdrawal(job)
            self._end_if_over(job)

    async def look_for_withdrawal(self, job: OpenJob) -> None:
        """Cancels an open job if clients of other instances have withdrawn it."""
        if not job.is_cancelled and await self._files.has(cancelled_key(job.id)):
            await self._check_askers(job)

    async def close(self) -> None:
        """Ends all batches, and leaves the jobs to other instances."""
        await self._dispatcher.close()
        await asyncio.gather(*self._ending, return_exceptions=True)
        try:
            for job in tuple(self.open.values()):
                await self._save_state(job)
            await self._owners.leave()
        except SurfaceError:
            _log.warning("jobs are left to other instances, which wait a minute before they go on")

    async def _store_manifest(self, manifest: Manifest, caller: str) -> None:
        """Stores what makes a job accepted; if that fails, there is no job."""
        id = manifest.id
        try:
            # The owner before the manifest: no job is without an owner. The manifest last: with it,
            # the job is accepted.
            await self._owners.take(id)
            # What may be left of one that has expired.
            await self._files.delete_all(f"{JOBS}/{id}/results")
            await self._askers.unmark_cancelled(id)
            await self._askers.add(id, caller)
            await self._files.write(manifest_key(id), manifest.encode(), durable=True)
        except SurfaceError:
            await self._files.delete(manifest_key(id))  # the store may have it all the same
            await self._askers.remove(id, caller)
            await self._owners.release(id)
            raise

    async def _join(self, manifest: Manifest, caller: str) -> JobState:
        """Lets a caller wait for a job that the store has; queues what is missing."""
        id = manifest.id
        await self._askers.add(id, caller)
        await self._askers.unmark_cancelled(id)
        if job := self.open.get(id):
            await self._update_askers(id)
            return job.state(self._dispatcher.waiting_for)
        state = await self._reader.state(id)
        owner = await self._owners.owner_of(id)
        if not (state.has_ended or await self._owners.is_gone_now(owner)):
            self._joined.add(id)
            return state
        half = timedelta(seconds=self._reader.lifetime / 2)
        is_old = state.ended is not None and datetime.now(UTC) > state.ended + half
        job = await self._load(manifest, again=True, is_old=is_old)
        if job.is_over:
            return state
        await self._owners.take(id)
        return await self._begin(job)

    async def _take_over(self, id: str, owner: str | None) -> None:
        """Takes a job over from an owner that is gone, unless another instance was faster."""
        async with self.lock(id):
            if id in self.open or await self._owners.owner_of(id) != owner:
                return
            manifest = await self._reader.manifest(id)
            if manifest is not None and manifest.engine != ENGINE:
                self.stranded.add(id)
                return
            await self._owners.take(id)
            state = None if manifest is None else await self._reader.state(id)
            # Without a manifest, the job was not accepted before its owner ended.
            if manifest is None or state is None or state.state in ("succeeded", "failed"):
                await self._owners.release(id)
                return
            _log.info("takes over the job %s", id)
            job = await self._load(manifest, again=False)
            job.started = state.started
            job.is_cancelled = not job.askers
            if not job.is_cancelled:
                await self._askers.unmark_cancelled(id)
            await self._begin(job)
        self._end_if_over(job)

    async def _load(self, manifest: Manifest, *, again: bool, is_old: bool = False) -> OpenJob:
        """A job as the store has it.

        Parameters
        ----------
        again : bool
            Whether to run batches again in which a part has failed.
        is_old : bool
            Whether to run all batches again: their parts are found, and live longer.
        """
        id = manifest.id
        job = OpenJob(manifest, self._reader.lifetime, await self._askers.of(id))
        for name in await self._files.names(f"{JOBS}/{id}/results"):
            number = int(name)
            records = await self._reader.records(manifest, number)
            if records is None:
                continue
            failed = sum(record["state"] == "failed" for record in records)
            if is_old or (again and failed):
                await self._files.delete(results_key(id, number))
            else:
                job.count(number, len(records) - failed, failed)
        return job

    async def _begin(self, job: OpenJob) -> JobState:
        self.open[job.id] = job
        with suppress(SurfaceError):  # `save` tries again
            await self._save_state(job)
        self._dispatcher.add(job)
        return job.state(self._dispatcher.waiting_for)

    async def _save_state(self, job: OpenJob) -> None:
        job.is_saved = True
        try:
            content = job.state(self._dispatcher.waiting_for).encode()
            await self._files.write(state_key(job.id), content)
        except SurfaceError:
            job.is_saved = False
            raise

    def _drop(self, id: str) -> None:
        """Leaves a job that another instance has taken over."""
        if job := self.open.pop(id, None):
            self._dispatcher.take_out(job)
            job.is_cancelled = True  # so that its running batches do not wait again

    async def _check_askers(self, job: OpenJob) -> None:
        """Looks whether a caller waits for an open job that another instance has cancelled."""
        async with self.lock(job.id):
            await self._update_askers(job.id)

    async def _update_askers(self, id: str) -> None:
        """Cancels an open job for which no caller waits; or goes on, for the first that waits."""
        job = self.open.get(id)
        if job is None:
            return
        askers = await self._askers.of(id)
        if not askers:
            job.is_cancelled = True
            self._dispatcher.cancel(job)
            self._on_change(job)
            return
        if askers[:1] != job.askers[:1]:
            self._dispatcher.take_out(job)
        job.askers, job.is_cancelled = askers, False
        self._dispatcher.add(job)

    def _on_change(self, job: OpenJob) -> None:
        """A batch of a job has ended or has stopped, or the job is cancelled."""
        job.is_saved = False
        self._end_if_over(job)

    def _end_if_over(self, job: OpenJob) -> None:
        if job.is_over and not job.is_ending and self.open.get(job.id) is job:
            job.is_ending = True
            task = asyncio.create_task(self._end(job))
            self._ending.add(task)
            task.add_done_callback(self._ending.discard)

    async def _end(self, job: OpenJob) -> None:
        """Stores the end of a job, and forgets the job; if the store fails, `save` tries again."""
        try:
            async with self.lock(job.id):
                # A caller has asked for it again, or another instance has taken it over.
                if not job.is_over or self.open.get(job.id) is not job:
                    return
                state = job.state(ended=datetime.now(UTC))
                await self._files.write(state_key(job.id), state.encode(), durable=True)
                # While the job has an owner, it counts as one that has not ended.
                await self._owners.release(job.id)
                self.open.pop(job.id, None)
        except SurfaceError:
            pass  # `translate_errors` has logged it
        finally:
            job.is_ending = False

    def lock(self, name: str) -> asyncio.Lock:
        """Held while the askers or the owner of a job change, or while a caller gets another job.

        `name` is the id of the job, or the name of the caller.
        """
        return self._locks.setdefault(name, asyncio.Lock())
