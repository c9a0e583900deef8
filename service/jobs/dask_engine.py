"""The engine of jobs on a Dask cluster: a batch of parts is a task of Dask distributed.

The scheduler gives tasks to workers, and those of a lost worker to another one. It holds no data: a
task is documents in bytes, workers write results to the store, and the records that a task returns
are released at once. While there is no scheduler, the engine says so, and connects again when it
gets the next batch. Parts whose results are in the store are not computed again.
"""

import asyncio
import logging
import math
import time
from collections.abc import Awaitable
from concurrent.futures import CancelledError
from contextlib import suppress
from typing import cast
from urllib.parse import urlsplit

from distributed import Client, KilledWorker, Security

from service.errors import InvalidSettings
from service.jobs.attempts import run_one_by_one
from service.jobs.batch import read_task
from service.jobs.dask_worker import FAILED, REFUSED, VERSION, run_task
from service.jobs.engine import EngineLost, EngineUnavailable

CONNECT_SECONDS = 10.0
"""Seconds within which the scheduler must respond; Dask tries several times until then."""

RECONNECT_PAUSE = 0.1
"""Seconds between looks whether the connection is there again."""

LOOK_SECONDS, RESTART_SECONDS = 5.0, 60.0
"""Seconds between looks whether there are workers, while a batch has no answer; seconds for which
there may be none, because lost workers start again."""

MAX_REFUSALS = 10
"""How often workers may refuse a batch before the engine gives it back."""

_log = logging.getLogger(__name__)


def open_dask(address: str, name: str) -> "DaskEngine":
    """The engine on the cluster whose scheduler has this address; it connects with the first batch.

    Parameters
    ----------
    address : str
        `tls://host:port`, with the certificates that Dask's own settings name. `tcp://host:port`,
        with a warning, for a scheduler that only this machine can reach.
    name : str
        The variable or flag that has the address, for errors.

    Raises
    ------
    InvalidSettings
        The address is invalid, or `tls://` lacks certificates.
    """
    try:
        parts = urlsplit(address)
        is_valid = parts.scheme in ("tls", "tcp") and bool(parts.hostname and parts.port)
    except ValueError:
        is_valid = False
    if not is_valid:
        raise InvalidSettings(
            f"{name}: got {address!r}, needed tls://host:port, the address of a Dask scheduler."
        )
    security = Security()
    if parts.scheme == "tls":
        _check_certificates(security, name)
    elif security.require_encryption:
        variable = "DASK_DISTRIBUTED__COMM__REQUIRE_ENCRYPTION"
        raise InvalidSettings(f"{name}: got {address!r}, but {variable} demands tls://.")
    else:
        text = "%s is without TLS: programs that reach the scheduler can run code here and there"
        _log.warning(text, name)
    return DaskEngine(address)


def _check_certificates(security: Security, name: str) -> None:
    variables = "DASK_DISTRIBUTED__COMM__TLS__ with CA_FILE, CLIENT__CERT and CLIENT__KEY"
    try:
        context = security.get_connection_args("client")["ssl_context"]
    except (OSError, ValueError) as error:
        reason = f"the files that {variables} name cannot be read: {error}"
        raise InvalidSettings(f"{name}: {reason}.") from None
    if context is None:
        raise InvalidSettings(f"{name}: tls:// needs certificates: set the variables {variables}.")


class DaskEngine:
    """Computes batches on a Dask cluster; all methods run in one event loop."""

    def __init__(self, address: str) -> None:
        self._address = address
        self._client: Client | None = None
        self._connecting, self._suspecting = asyncio.Lock(), asyncio.Lock()
        self._refusals: set[bytes] = set()  # those that the log has
        self._is_lost = False
        self._last_workers = -math.inf  # when there were workers, on the monotonic clock

    @property
    def slots(self) -> int:
        """Two batches for each thread of the cluster, so that none waits for its next batch.

        One while there are no threads: this batch finds out when there are.
        """
        return max(1, 2 * self._threads)

    @property
    def _threads(self) -> int:
        """The threads of all workers; Dask asks the scheduler every 2 s."""
        if self._client is None or self._client.status != "running":
            return 0
        return int(self._client.scheduler_info()["total_threads"])

    async def run(self, task: bytes) -> bytes:
        """Runs a task on any worker, and returns its result (`Engine.run`).

        A batch that killed its workers is submitted part by part. If this is cancelled, Dask
        forgets the task; a worker that computes it sees that its job is withdrawn.

        Raises
        ------
        EngineLost
            A part killed its workers.
        EngineUnavailable
            There is no scheduler (`no_scheduler`) or no worker (`no_workers`), workers have another
            version or engine (`other_version`), or one cannot run the task, perhaps because it does
            not reach the store (`worker_failed`). The log names the workers.
        """
        try:
            return await self._compute(task)
        except KilledWorker as error:
            _log.warning("A batch or a part killed its workers: %s", error)
        batch = read_task(task)
        if len(batch.lines) == 1:
            raise EngineLost
        # One part at a time: Dask suspects all tasks of a lost worker, even those that waited.
        async with self._suspecting:
            return (await run_one_by_one(self, batch)).write()

    async def close(self) -> None:
        """Disconnect; the scheduler forgets the tasks of this engine."""
        client, self._client = self._client, None
        if client is not None:
            await client.close()

    async def _compute(self, task: bytes) -> bytes:
        """The result of a task; raises the errors of `run` and `KilledWorker`."""
        for _ in range(MAX_REFUSALS):
            answer = await self._submit(task)
            if not answer.startswith((REFUSED, FAILED)):
                return answer
            if answer.startswith(FAILED) or answer not in self._refusals:
                _log.warning("A batch was %s", answer.decode(errors="replace"))
            if answer.startswith(FAILED):
                raise EngineUnavailable("worker_failed")
            self._refusals.add(answer)
        raise EngineUnavailable("other_version")

    async def _submit(self, task: bytes) -> bytes:
        """The answer of a worker to a task."""
        client = await self._connect()
        self._is_lost = False
        # Not `pure`: a task that is submitted again is computed again.
        future = client.submit(run_task, b"\n".join((VERSION.encode(), task)), pure=False)
        try:
            while not future.done():
                self._check_workers()
                with suppress(TimeoutError):
                    await future.exception(timeout=LOOK_SECONDS)
            # Dask fetches the results of several futures together: none may be cancelled.
            return await asyncio.shield(cast(Awaitable[bytes], future.result()))
        except KilledWorker:
            self._last_workers = time.monotonic()
            raise
        except (CancelledError, OSError):
            raise self._unavailable() from None
        finally:
            future.release()

    async def _connect(self) -> Client:
        """The client, connected."""
        async with self._connecting:
            while self._client is not None and self._client.status == "connecting":
                await asyncio.sleep(RECONNECT_PAUSE)  # it connects again by itself, or closes
            if self._client is not None and self._client.status == "running":
                return self._client
            await self.close()
            client = Client(
                self._address, asynchronous=True, set_as_default=False, timeout=CONNECT_SECONDS
            )
            try:
                self._client = await client
            except OSError:
                raise self._unavailable() from None
            return client

    def _check_workers(self) -> None:
        """Raise `EngineUnavailable` if there has been no worker for `RESTART_SECONDS`, or ever."""
        now = time.monotonic()
        if self._threads:
            self._last_workers = now
        elif now > self._last_workers + RESTART_SECONDS:
            raise EngineUnavailable("no_workers")

    def _unavailable(self) -> EngineUnavailable:
        """The error without a scheduler; the log has it once until there is one again."""
        if not self._is_lost:
            _log.warning("The scheduler at %s does not respond", self._address)
        self._is_lost = True
        return EngineUnavailable("no_scheduler")
