"""Watches a store: whether it answers, and whether it can be written."""

import asyncio
import logging
import math
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import Literal, NoReturn, TypeAlias

from anyio import Lock

from service.errors import StoreFailed, StoreFull
from service.storage.backends import Backend
from service.storage.failures import Operations, is_disk_full, is_read_only, translate_errors

CHECK_INTERVAL = 5.0
"""Seconds for which the result of a check stays valid."""

PROBE_INTERVAL = 60.0
"""Seconds between two tests of writing."""

DEADLINE = 1.0
"""Seconds after which a check counts as failed; and for which it waits for a test of writing."""

PROBE_DEADLINE = 10.0
"""Seconds after which a test of writing counts as failed."""

MAX_FAILURES = 2
"""Checks that must fail, one after the other, until the store counts as failed: a single slow check
is not enough. A store that has never answered has failed."""

PROBE_KEY = ".surface-probe"
"""The key of the object that tests of writing replace; all instances write the same content."""

Writes: TypeAlias = Literal["ready", "read_only", "full", "unavailable"]
"""Whether a store can be written, and if not, why."""

_log = logging.getLogger(__name__)


class Watch:
    """The state of a backend: by checks of reading, by tests of writing, and by all other writes.

    Attributes
    ----------
    failures : int
        Checks that have failed since the last success.
    """

    def __init__(self, backend: Backend, operations: Operations) -> None:
        self._backend, self._operations = backend, operations
        self._lock = Lock()
        self._last_check = self._last_probe = -math.inf
        self._probe: asyncio.Task[None] | None = None
        self._writes: Writes = "unavailable"
        self.failures = MAX_FAILURES

    @property
    def has_failed(self) -> bool:
        """Whether the store has never answered, or the last checks have failed."""
        return self.failures >= MAX_FAILURES

    @property
    def writes(self) -> Writes:
        """Whether the store can be written, as the last write or test of writing showed."""
        return "unavailable" if self.failures else self._writes

    async def check(self) -> bool:
        """Whether the store answers; the result is at most `CHECK_INTERVAL` old.

        Starts a test of writing if the last one is older than `PROBE_INTERVAL`.
        """
        async with self._lock:
            now = time.monotonic()
            if now - self._last_check >= CHECK_INTERVAL:
                self._last_check = now
                try:
                    action = "checking that the store is ready"
                    with self._operations.count("ask"), translate_errors(action):
                        await asyncio.wait_for(self._backend.check(), DEADLINE)
                    self.failures = 0
                except StoreFailed:
                    self.failures += 1
            if not self.failures and now - self._last_probe >= PROBE_INTERVAL:
                self._last_probe = now
                self._probe = asyncio.create_task(self._write_probe())
                await asyncio.wait([self._probe], timeout=DEADLINE)
            return not self.failures

    @contextmanager
    def note_write(self) -> Iterator[None]:
        """Notes by the outcome of the `with` block, a write, whether the store can be written.

        A write that is cancelled shows nothing.
        """
        try:
            yield
        except Exception as error:
            writes: Writes = "read_only" if is_read_only(error) else "unavailable"
            if is_disk_full(error):
                writes = "full"
            if writes != self._writes:
                _log.warning("the store cannot be written: %s", writes)
            self._writes = writes
            raise
        self._writes = "ready"

    async def run(self) -> NoReturn:
        """Checks the store again and again, until cancelled."""
        while True:
            await self.check()
            await asyncio.sleep(CHECK_INTERVAL)

    async def _write_probe(self) -> None:
        with (
            suppress(StoreFailed, StoreFull),
            self._operations.count("probe"),
            translate_errors("testing whether the store can be written"),
            self.note_write(),
        ):
            write = self._backend.write(PROBE_KEY, b"surface-service\n")
            await asyncio.wait_for(write, PROBE_DEADLINE)
