"""Threads and memory for all requests: a bounded queue for each caller, and a memory budget.

Short work runs on the event loop. Other work waits until a thread and enough memory are free and no
thread has just begun (`ALONE_SECONDS`). What one request does with its threads and its memory is in
`computation`.

**Turns.** The caller that has used the fewest thread seconds is served first (`service.fair`). One
thread more than the setting says takes only work of callers that hold no thread: so one caller with
long work does not keep all others waiting. If the queue is full, the newest request of the caller
with the most waiting requests is refused with 429 and `Retry-After`.

**Memory.** The first caller in turn whose work does not fit into the free memory *claims* its
memory, one at a time. Work of other callers may pass only into memory that the claim leaves free:
the bytes of all work that has passed a claim, of the bodies, of the new work and of the claim must
fit together. So large work does not keep small work waiting while there is memory for both. And it
waits at most until the work from before the claim has ended, and then the work that has passed it:
once only these are left, memory into which other work may pass is memory in which the claim begins.

**Unread responses.** Work of a caller that has not read its earlier responses waits too, and claims
nothing: `unread`.

Why requests cannot deadlock: bodies hold at most 1/4 of the memory and never wait for it; 1/16 is
for work on the event loop; a request asks once for memory to work in, at most the other 11/16. So
when the running requests have ended, the claim can start.
"""

import asyncio
import math
import time
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass

from anyio import CapacityLimiter, to_thread

from service.api.caching.cache import ResponseCache
from service.api.unread import SHARE, UnreadBytes
from service.errors import Busy
from service.fair.accounts import Accounts
from service.fair.compute_limit import ComputeLimit
from service.fair.lock import FairLock
from service.fair.queue import FairQueue
from service.settings.runtime import trim_heap
from service.settings.values import Settings

ROUND_SECONDS = 0.002
"""Time for which the event loop does short work before it serves other connections."""

ALONE_SECONDS = 0.2
"""Time for which a thread that begins computes alone. Two threads whose NumPy calls are short wait
for Python's lock again and again: together they make 0.7 times as many meshes as one after the
other (one patch at a relative tolerance of 1e-3, and the teapot). Work that takes longer has larger
arrays, for which NumPy releases the lock."""

EXTRA_ALONE_SECONDS = 0.05
"""Time for which other threads compute alone before the one beyond the setting begins: its work is
mostly short, and should not wait long."""

TRIM_PAUSE = 0.25
"""Seconds from the end of a large request until free memory goes back to the system."""

MAX_RETRY_AFTER = 60
"""The most seconds that `Retry-After` names."""


@dataclass(eq=False, slots=True)
class Turn:
    """Work that asks for a thread, and what it needs.

    Attributes
    ----------
    caller : str
    memory : int
        Bytes to work in.
    response : int
        The most bytes of its response, or 0 if this is unknown.
    least_seconds : float
        Thread seconds that it surely takes, or 0.
    deadline : float
        The time at which it is dropped, on the clock `time.monotonic`.
    start : float
        The time at which its thread began.
    has_passed : bool
        Whether it began although other work had claimed memory.
    grant : Future or None
        Done when a thread and memory are taken; None if they were free at once.
    """

    caller: str
    memory: int
    response: int = 0
    least_seconds: float = 0.0
    deadline: float = math.inf
    start: float = -math.inf
    has_passed: bool = False
    grant: asyncio.Future[None] | None = None


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
    passed_bytes : int
        Bytes of `used_bytes` that are held by work that has passed a claim, and by batches of jobs.
    count : int
        Threads for long work, without the one for callers that hold none.
    accounts : Accounts
        The thread seconds of all callers. Work that runs elsewhere is charged there too.
    parsing : FairLock
        Held while the thread for long bodies parses one.
    unread : UnreadBytes
        Bytes of the responses that callers have not read yet.
    limiter : CapacityLimiter
        Limits all these threads and the one of `trim`; so large that no work waits for it.
    request_timeout : float
        Seconds from a request's first block of `Computation.until_deadline` to its deadline.
    seconds_waited : float
        The waiting time of all requests since the start.
    on_wait : callable
        Called with the kind of work, and the seconds for which it has waited.
    """

    def __init__(self, settings: Settings, cache: ResponseCache) -> None:
        self.capacity = settings.memory_bytes
        self.max_body, self.max_memory = self.capacity // 4, self.capacity * 11 // 16
        self.count = settings.thread_count
        self.request_timeout = settings.request_timeout
        self.used_bytes = self.body_bytes = self.passed_bytes = 0
        self.seconds_waited = 0.0
        self.on_wait: Callable[[str, float], None] = lambda _kind, _seconds: None
        limit = settings.compute_limit
        self.accounts = Accounts(ComputeLimit(limit) if limit else None)
        self.parsing = FairLock(self.accounts)
        self.unread = UnreadBytes(self.capacity // SHARE, self.start_queued)
        self.limiter = CapacityLimiter(2 * self.count + 4)
        self._max_queue = settings.max_queue
        self._queue: FairQueue[Turn] = FairQueue(self.accounts)
        self._claim: Turn | None = None
        self._last_start = -math.inf
        self._trimming: asyncio.Task[None] | None = None
        self._round_end: float | None = None
        self._cache = cache
        cache.on_sent = self.start_queued
        self.hold(0)  # sets the bound of the cache

    @property
    def queue_length(self) -> int:
        """Number of requests that wait for a thread or for memory."""
        return self._queue.length

    @property
    def busy_count(self) -> int:
        """Number of the threads that compute now."""
        return self._queue.busy_count

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
        if amount < 0 and self._queue.waiting:
            self.start_queued()

    async def acquire(self, turn: Turn, kind: str) -> None:
        """Waits for a thread, and for memory; takes both, and room for the response.

        Parameters
        ----------
        kind : str
            The kind of work, for the histogram of waiting times.

        Raises
        ------
        Busy
            The queue is full, and no other caller has more waiting work; or the work that its
            caller has in the queue before it surely takes until after its deadline.
        """
        if self.try_acquire(turn):
            self.on_wait(kind, 0.0)
            return
        self._enqueue(turn)
        wait_start = time.monotonic()
        self.start_queued()
        assert turn.grant is not None
        try:
            await turn.grant
        except asyncio.CancelledError:
            if turn.grant.cancelled():
                with suppress(ValueError):  # no longer queued
                    self._queue.remove(turn.caller, turn)
                self._drop_claim(turn)
                self.start_queued()  # the next request may fit
            elif turn.grant.exception() is None:  # granted just before the cancellation
                self.release_thread(turn)
                self.give_back(turn)
            raise
        finally:
            seconds = time.monotonic() - wait_start
            self.seconds_waited += seconds
            self.on_wait(kind, seconds)

    def try_acquire(self, turn: Turn) -> bool:
        """Takes a thread, memory and room if no work waits and all are free; whether it did."""
        return not self._queue.waiting and self._try_start(turn)

    def release_thread(self, turn: Turn) -> None:
        """Gives back the thread of a turn; its memory and its room for a response stay taken."""
        self._queue.return_thread(turn.caller)
        if turn.start == self._last_start:
            self._last_start = -math.inf
        self.start_queued()

    def give_back(self, turn: Turn) -> None:
        """Gives back the memory and the room for a response that a turn has taken."""
        if turn.has_passed:
            self.passed_bytes -= turn.memory
        if turn.response:
            self.unread.add(turn.caller, -turn.response)
        self.hold(-turn.memory)

    async def take_turn(self) -> None:
        """Waits until short work may run in this round of the event loop."""
        while self._round_end is not None and time.perf_counter() > self._round_end:
            await asyncio.sleep(0)
        if self._round_end is None:
            self._round_end = time.perf_counter() + ROUND_SECONDS
            asyncio.get_running_loop().call_soon(setattr, self, "_round_end", None)

    def start_queued(self) -> None:
        """Starts waiting work, in turn, while threads and memory are free."""
        while self._queue.waiting and self.busy_count <= self.count and self._start_next():
            pass

    def trim(self) -> None:
        """Gives free memory back to the system, once for all requests that end together."""

        async def trim_soon() -> None:
            await asyncio.sleep(TRIM_PAUSE)
            self._trimming = None  # requests that end from now on need another call
            await to_thread.run_sync(trim_heap, limiter=self.limiter)

        self._trimming = self._trimming or asyncio.get_running_loop().create_task(trim_soon())

    def _enqueue(self, turn: Turn) -> None:
        """Puts work behind the other work of its caller; raises `Busy` if there is no place."""
        if turn.least_seconds and turn.deadline < math.inf:
            own = (turn, *self._queue.waiting.get(turn.caller, ()))
            least_seconds = sum(each.least_seconds for each in own) / (self.count + 1)
            if time.monotonic() + least_seconds > turn.deadline:
                raise Busy
        if self._queue.length >= self._max_queue:
            pushed_out = self._queue.push_out(turn.caller)
            if pushed_out is None:
                raise Busy
            self._drop_claim(pushed_out)
            if pushed_out.grant is not None and not pushed_out.grant.done():
                pushed_out.grant.set_exception(Busy())
        turn.grant = asyncio.get_running_loop().create_future()
        self._queue.add(turn.caller, turn)

    def _start_next(self) -> bool:
        """Starts the work of the first caller in turn for which there is room; False if none."""
        for caller in self._queue.in_turn():
            turn = self._queue.first(caller)
            grant = turn.grant
            assert grant is not None
            if grant.done():  # cancelled
                self._drop_claim(turn)
            elif not self._try_start(turn):
                continue
            else:
                grant.set_result(None)
            self._queue.remove(caller, turn)
            return True
        return False

    def _try_start(self, turn: Turn) -> bool:
        """Takes a thread and the memory if both are free; if only the memory is not, claims it."""
        queue, now = self._queue, time.monotonic()
        may_use_extra = turn.caller not in queue.held
        is_extra = queue.busy_count >= self.count
        pause = EXTRA_ALONE_SECONDS if is_extra else ALONE_SECONDS
        if queue.busy_count >= self.count + may_use_extra or now < self._last_start + pause:
            return False
        if not self.unread.has_room(turn.caller, turn.response):
            self._drop_claim(turn)
            return False
        claim = self._claim
        has_passed = claim is not None and claim is not turn
        if not self.has_room(turn.memory) or (has_passed and not self.may_pass(turn.memory)):
            if claim is None and turn.grant is not None:
                self._claim = turn
            return False
        self._drop_claim(turn)
        self._last_start = turn.start = now
        queue.take_thread(turn.caller)
        if has_passed:
            turn.has_passed = True
            self.passed_bytes += turn.memory
        if turn.response:
            self.unread.add(turn.caller, turn.response)
        self.hold(turn.memory)
        loop = asyncio.get_running_loop()
        loop.call_later(EXTRA_ALONE_SECONDS, self.start_queued)
        loop.call_later(ALONE_SECONDS, self.start_queued)
        return True

    def may_pass(self, memory: int) -> bool:
        """Whether the memory of the claim stays reachable if work of these bytes begins before it.

        True if nothing is claimed.
        """
        if self._claim is None:
            return True
        others = self.passed_bytes + self.body_bytes + memory
        return others + self._claim.memory <= self.capacity * 15 // 16

    def _drop_claim(self, turn: Turn) -> None:
        if self._claim is turn:
            self._claim = None
