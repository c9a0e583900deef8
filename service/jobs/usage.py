"""The quota of jobs: the bytes of files, parts, results and records, apart from the surfaces'."""

from service.errors import Issue, JobQuotaFull, StoreFull
from service.jobs.files import JobFiles
from service.jobs.keys import FILES, INTAKE, JOBS, PARTS
from service.storage.quota import Usage


class JobUsage:
    """Counts the bytes of all jobs in the store, as `Usage` counts those of surfaces.

    The size of a result is known only when it has been computed, so batches that run at the same
    time may exceed the quota by their results.
    """

    def __init__(self, files: JobFiles, quota: int) -> None:
        self._files = files
        self._usage = Usage(quota, self._list_bytes)

    @property
    def used(self) -> int | None:
        """Bytes in use, as last counted; None before the first count, or without a quota."""
        return self._usage.used

    @property
    def quota(self) -> int:
        """Most bytes that may be in use; 0 means no limit."""
        return self._usage.quota

    def add(self, growth: int) -> None:
        """Counts bytes that were stored."""
        self._usage.add(growth)

    async def recount(self) -> None:
        """Counts by a listing."""
        await self._usage.recount()

    async def check_room(self, growth: int) -> None:
        """Raises `JobQuotaFull` if less than `growth` bytes are free."""
        try:
            await self._usage.check_room(growth)
        except StoreFull as error:
            message = "The results of jobs take all the bytes that the operator allows them."
            issue = error.issues[0]
            raise JobQuotaFull(
                Issue("job_quota_full", message, got=issue.got, needed=issue.needed)
            ) from None

    async def _list_bytes(self) -> int:
        total = 0
        for prefix in (PARTS, JOBS, INTAKE, FILES):
            async for entry in self._files.entries(prefix):
                total += entry.size
        return total
