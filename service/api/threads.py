"""Threads and memory for all requests: a bounded queue, and a memory budget.

Short work runs on the event loop. Other work waits, in order of arrival, until a thread and enough
memory are free and no thread has just begun (`ALONE_SECONDS`). The length of the queue is bounded:
if it is full, the service refuses a request with 429 and `Retry-After`. What one request does with
its threads and its memory is in `job`.

Why requests cannot deadlock: bodies hold at most 1/4 of the memory and never wait for it; 1/16 is
for work on the event loop; a request asks once for memory to work in, at most the other 11/16. So
when the running requests have ended, the first request in the queue can start.
"""

import asyncio
import math
import time
from collections import deque
from contextlib import suppress

from anyio import CapacityLimiter, to_thread

from service.api.caching.cache import ResponseCache
from service.errors import Busy
from service.settings.runtime import trim_heap
from service.settings.values import Settings

ROUND_SECONDS = 0.002
"""Time for which the event loop does short work before it serves other connections."""

ALONE_SECONDS = 0.2
"""Time for which a thread that begins computes alone. Two threads whose NumPy calls are short wait
for Python's lock again and again: together they make 0.7 times as many meshes as one after the
other (one patch at a relative tolerance of 1e-3, and the teapot). Work that takes longer has larger
arrays, for which NumPy releases the lock."""

TRIM_PAUSE = 0.25
"""Seconds from the end of a large request until free memory goes back to the system."""

MAX_RETRY_AFTER = 60
"""The most seconds that `Retry-After` names."""


class Threads:
    """The threads and the memory that all requests share.

    Short work takes turns on the event loop (`take_turn`). One thread parses long bodies: a second
    would not help, because parsing keeps Python's lock.

    Attributes
    ----------
    capacity, used_bytes, body_bytes : int
        Bytes for all requests; bytes that they hold now; bytes of these that bodies hold.
    max_body, max_memory : int
        Most bytes for all bodies together; most bytes in which one request may work.
    count, busy_count : int
        Threads for long work; the number of them that compute now.
    parse_lock : Lock
        Held while the thread for long bodies parses one.
    limiter : CapacityLimiter
        Limits all these threads and the one of `trim`; so large that no work waits for it.
    request_timeout : float
        Seconds from a request's first block of `Job.until_deadline` to its deadline.
    seconds_waited : float
        The waiting time of all requests since the start.
    """

    def __init__(self, settings: Settings, cache: ResponseCache) -> None:
        self.capacity = settings.memory_bytes
        self.max_body, self.max_memory = self.capacity // 4, self.capacity * 11 // 16
        self.count = settings.thread_count
        self.request_timeout = settings.request_timeout
        self.used_bytes = self.body_bytes = self.busy_count = 0
        self.seconds_waited = 0.0
        self.parse_lock = asyncio.Lock()
        self.limiter = CapacityLimiter(2 * self.count + 2)
        self._max_queue = settings.max_queue
        self._queue: deque[tuple[int, asyncio.Future[float]]] = deque()
        self._last_start = -math.inf
        self._trimming: asyncio.Task[None] | None = None
        self._round_end: float | None = None
        self._cache = cache
        cache.on_sent = self.start_queued
        self.hold(0)  # sets the bound of the cache

    @property
    def queue_length(self) -> int:
        """Number of requests that wait for a thread or for memory."""
        return len(self._queue)

    def retry_after(self) -> int:
        """Seconds until a client may try again: 1, and 1 for each round of waiting requests."""
        return min(1 + math.ceil(self.queue_length / self.count), MAX_RETRY_AFTER)

    def has_room(self, amount: int, *, is_small: bool = False) -> bool:
        """Whether `amount` bytes are free; only small work may use the last 1/16 of the memory."""
        limit = self.capacity if is_small else self.capacity * 15 // 16
        return self.used_bytes + self._cache.bytes_being_sent + amount <= limit

    def hold(self, amount: int) -> None:
        """Takes `amount` bytes, or gives -`amount` bytes back; the cache may use the rest."""
        self.used_bytes += amount
        self._cache.resize(self.capacity - self.used_bytes)
        if amount < 0 and self._queue:
            self.start_queued()

    async def acquire(self, amount: int) -> float:
        """Waits, in order of arrival, for a thread and `amount` bytes; or raises `Busy`.

        Returns
        -------
        float
            The time at which the thread begins, for `release_thread`.
        """
        if not self._queue and (start := self._try_start(amount)) is not None:
            return start
        if len(self._queue) >= self._max_queue:
            raise Busy
        grant: asyncio.Future[float] = asyncio.get_running_loop().create_future()
        self._queue.append(entry := (amount, grant))
        wait_start = time.monotonic()
        try:
            return await grant
        except asyncio.CancelledError:
            if grant.cancelled():
                with suppress(ValueError):  # no longer queued
                    self._queue.remove(entry)
                self.start_queued()  # the next request may fit
            else:  # the thread and the memory were granted just before the cancellation
                self.release_thread(grant.result())
                self.hold(-amount)
            raise
        finally:
            self.seconds_waited += time.monotonic() - wait_start

    def release_thread(self, start: float) -> None:
        """Gives back the thread that began at `start`."""
        self.busy_count -= 1
        if start == self._last_start:
            self._last_start = -math.inf
        self.start_queued()

    async def take_turn(self) -> None:
        """Waits until short work may run in this round of the event loop."""
        while self._round_end is not None and time.perf_counter() > self._round_end:
            await asyncio.sleep(0)
        if self._round_end is None:
            self._round_end = time.perf_counter() + ROUND_SECONDS
            asyncio.get_running_loop().call_soon(setattr, self, "_round_end", None)

    def start_queued(self) -> None:
        """Starts the requests that have waited longest, while threads and memory are free."""
        while self._queue:
            amount, grant = self._queue[0]
            if not grant.done():
                if (start := self._try_start(amount)) is None:
                    return
                grant.set_result(start)
            self._queue.popleft()

    def trim(self) -> None:
        """Gives free memory back to the system, once for all requests that end together."""

        async def trim_soon() -> None:
            await asyncio.sleep(TRIM_PAUSE)
            self._trimming = None  # requests that end from now on need another call
            await to_thread.run_sync(trim_heap, limiter=self.limiter)

        self._trimming = self._trimming or asyncio.get_running_loop().create_task(trim_soon())

    def _try_start(self, amount: int) -> float | None:
        """Takes a thread and the memory if both are free; returns the start time, else None."""
        now = time.monotonic()
        has_just_begun = now < self._last_start + ALONE_SECONDS
        if has_just_begun or self.busy_count >= self.count or not self.has_room(amount):
            return None
        self._last_start = now
        self.busy_count += 1
        self.hold(amount)
        asyncio.get_running_loop().call_later(ALONE_SECONDS, self.start_queued)
        return now
