"""A computation: the memory and the threads of one request, its deadline and its cancellation.

Short work runs on the event loop; if it takes longer than expected, it begins again in a thread.
Other work runs in a thread as soon as `Threads` grants one. A request ends at its deadline, or when
its client disconnects; its work in a thread then stops at the next checkpoint.
"""

import asyncio
import math
import time
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager, suppress
from functools import cached_property, partial
from traceback import clear_frames
from typing import Any, TypeAlias, TypeVar, cast

from anyio import CancelScope, current_time, to_thread
from starlette.requests import ClientDisconnect
from starlette.types import Receive

from service.api.errors import compute_limited
from service.api.record import Timing
from service.api.threads import Threads, Turn
from service.cancellation import Cancellation, Cancelled, OutOfTime, cancelled_by
from service.errors import Busy, Issue, TooLarge
from service.interpreter import run_in_short_turns
from service.pipeline.cost import Cost, Work

INLINE_SECONDS = 0.0075
"""Estimated time (`Cost.seconds`) up to which work runs on the event loop. To change to a thread
would take as long, because threads take turns of 5 ms. The estimate is an upper bound for small
meshes: 4.5 ms for the teapot at 16 divisions in a .glb file, which takes 0.8 ms, or 2.4 ms if its
plan is not cached."""

MAX_INLINE_SECONDS = 0.1
"""Work on the event loop that takes longer than this, although its estimate is small, stops at the
next checkpoint and begins again in a thread."""

TRIM_BYTES = 4 << 20
"""After a request that took at least this many bytes, free memory goes back to the system."""

MAX_BUFFERED = 1 << 16
"""Most bytes of a body that is sent in one message: the server buffers the body, and the service
does not wait for the client. A longer body ends with an empty message, before which the server
waits until a slow client has received almost all of the body."""

SMALL_BODY = 1 << 20
"""A body of at most this many bytes may use the last 1/10 of the bodies' memory."""

Callbacks: TypeAlias = list[Callable[[], None]]
Result = TypeVar("Result")


class Computation:
    """Memory and threads of one request, or of one computation that several requests share.

    At its end, a computation gives its memory and threads back. Memory that a thread still uses is
    given back when that thread ends: the thread may notice its cancellation only after half a
    second.

    Parameters
    ----------
    receive : callable, optional
        Returns messages of the client; shows that it has disconnected. A shared computation has
        none, because it ends with its last user.
    find_caller : callable, optional
        Returns the name of the caller that is charged for the work. For a shared computation this
        is the caller that asked first.
    is_shared : bool
        Whether several requests share the computation: each of them counts the response for itself.
    """

    def __init__(
        self,
        threads: Threads,
        receive: Receive | None = None,
        find_caller: Callable[[], str] = str,
        *,
        is_shared: bool = False,
    ) -> None:
        self.threads = threads
        self._find_caller, self._is_shared = find_caller, is_shared
        self.cancellation = Cancellation()
        self.on_ready: Callbacks = []
        self.on_end: Callbacks = []
        """Callbacks: `on_ready` for the moment when the response is ready, `on_end` for the moment
        when the response has been sent or the client has disconnected."""
        self.timing = Timing()
        self._receive = receive
        self._deadline = math.inf
        self._body = self._memory = self._peak = 0
        # Of `_memory`: bytes with which the computation has passed a claim, and bytes of the
        # response that the caller has not read.
        self._passed = self._unread = 0
        self._inline_seconds = 0.0
        self._running: set[asyncio.Task[Any]] = set()
        self._ran_inline = self._is_over = False

    @cached_property
    def caller(self) -> str:
        """The name of the caller that is charged for the work."""
        return self._find_caller()

    def check_compute_limit(self) -> None:
        """Refuses a request whose caller has used its thread seconds, if these are limited.

        Raises
        ------
        ComputeLimited
        """
        limit = self.threads.accounts.limit
        if limit is None or self._is_shared:
            return
        self.threads.accounts.charge_running()
        retry_after = limit.state(self.caller).retry_after
        if retry_after:
            raise compute_limited(limit.seconds, retry_after)

    @property
    def body_memory(self) -> int:
        """The bytes of memory that the body takes now."""
        return self._body

    def hold_body(self, size: int) -> None:
        """Sets the memory that the body takes: more while it arrives, less once it is parsed.

        Raises
        ------
        TooLarge
            No body may take `size` bytes of memory.
        Busy
            Other requests hold the memory now.
        """
        growth, threads = size - self._body, self.threads
        if size > threads.max_body * 9 // 10:
            raise TooLarge(
                Issue(
                    "too_much_memory",
                    "The body would take more memory than this service has for one body.",
                    got=f"at least {size} bytes",
                    needed=f"at most {threads.max_body * 9 // 10} bytes; a smaller surface",
                )
            )
        # Large bodies leave 1/10 of the memory to small ones.
        room = threads.max_body * (10 if size <= SMALL_BODY else 9) // 10
        if growth > 0 and not (
            threads.body_bytes + growth <= room and threads.has_room(growth, is_small=True)
        ):
            raise Busy
        self._peak = max(self._peak, size)
        self._body = size
        threads.body_bytes += growth
        threads.hold(growth)

    def shrink_body(self, size: int) -> None:
        """Gives memory back once the body is parsed and takes at most `size` bytes.

        Keeps the memory of a body of at most `SMALL_BODY` bytes: `finish_work` gives it back soon.
        """
        if size < self._body and self._body > SMALL_BODY:
            self.hold_body(size)

    async def parse(self, call: Callable[[], Result], *, is_long: bool) -> Result:
        """Returns the result of `call()`: run on the event loop, or for long bodies in a thread."""
        if not is_long:
            await self.threads.take_turn()
            self._ran_inline = True
            start = time.perf_counter()
            try:
                with self.timing.step("parse"):
                    return call()
            finally:
                self._inline_seconds += time.perf_counter() - start
        threads, caller = self.threads, self.caller
        async with self.until_deadline():
            start = time.perf_counter()
            with self.timing.step("wait"):
                await threads.parsing.acquire(caller)
            threads.on_wait("parse", time.perf_counter() - start)
            with self.timing.step("parse"):
                parse = partial(run_in_short_turns, call)
                return await self._in_thread(parse, lambda: threads.parsing.release(caller))

    async def run(self, work: Work[Result], name: str) -> Result:
        """Returns the result of `work`: short work runs on the event loop, other work in a thread.

        Parameters
        ----------
        name : str
            The name of the work in the header `Server-Timing`.

        Raises
        ------
        Busy, OutOfTime, ClientDisconnect
            Or the error of the work.
        """
        cost, threads = work.cost, self.threads
        if self._is_short(cost):
            self._memory += cost.memory
            threads.hold(cost.memory)
            if not self._ran_inline:  # one turn is enough for parsing and work of one request
                await threads.take_turn()
                self._ran_inline = True
            time_limit = Cancellation(time.monotonic() + MAX_INLINE_SECONDS)
            start = time.perf_counter()
            try:
                with self.timing.step(name), suppress(OutOfTime), cancelled_by(time_limit):
                    return work.run()
            finally:
                self._inline_seconds += time.perf_counter() - start
            # It took longer than `MAX_INLINE_SECONDS`: begin again in a thread.
            self._memory -= cost.memory
            threads.hold(-cost.memory)
        # The cost is an upper bound; `acquire` could never grant more than `max_memory`.
        amount = min(cost.memory, threads.max_memory)
        response = min(cost.response, amount)
        turn = Turn(self.caller, amount, response, cost.least_seconds)
        async with self.until_deadline():
            turn.deadline = self.cancellation.deadline
            with self.timing.step("wait"):
                await threads.acquire(turn, name)
            return await self._run_in_turn(turn, work, name)

    async def run_at_once(self, work: Work[Result], name: str) -> Result | None:
        """Returns the result of `work`; None if it would have to wait for a thread or for memory.

        For work on a response that is ready: while it waited, it would hold the response, for whose
        memory others wait. The work makes no response of its own.
        """
        if self._is_short(work.cost):
            return await self.run(work, name)
        turn = Turn(self.caller, work.cost.memory)
        async with self.until_deadline():
            if not self.threads.try_acquire(turn):
                return None
            return await self._run_in_turn(turn, work, name)

    async def _run_in_turn(self, turn: Turn, work: Work[Result], name: str) -> Result:
        """Returns the result of `work`, run in the thread that `turn` has taken."""
        self._memory += turn.memory
        self._unread += turn.response
        self._passed += turn.memory if turn.has_passed else 0
        with self.timing.step(name):
            return await self._in_thread(work.run, lambda: self.threads.release_thread(turn))

    def _is_short(self, cost: Cost) -> bool:
        """Whether work is short enough for the event loop, and there is memory for it now."""
        threads = self.threads
        return (
            cost.seconds <= INLINE_SECONDS
            and threads.has_room(cost.memory, is_small=True)
            and (not threads.unread.totals or self._has_room_for_response(cost))
        )

    def _has_room_for_response(self, cost: Cost) -> bool:
        """Whether the caller may begin another response. Short ones wait for no client."""
        if 0 < cost.response <= MAX_BUFFERED:
            return True
        return self.threads.unread.has_room(self.caller, cost.response)

    def drop_work(self) -> None:
        """Gives the memory of work back that has ended without a result, before other work runs."""
        self._peak = max(self._peak, self._body + self._memory)
        dropped, self._memory = self._memory, 0
        self._count_memory(0, is_response=False)
        self.threads.hold(-dropped)

    def finish_work(self, size: int, *, is_response: bool = True) -> None:
        """Gives all memory back except the `size` bytes of the result, which is ready.

        Takes no further memory for a result that is larger than the memory of the work. Unless
        `is_response` is false, the result is what the caller has to read.
        """
        while self.on_ready:
            self.on_ready.pop()()
        total, response_memory = self._body + self._memory, min(size, self._memory)
        self._peak = max(self._peak, total)
        self.threads.body_bytes -= self._body
        self._body, self._memory = 0, response_memory
        if response_memory > MAX_BUFFERED or self._unread or self._passed:
            self._count_memory(response_memory, is_response=is_response)
        if total > response_memory:
            self.threads.hold(response_memory - total)

    def release_sent(self, size: int) -> None:
        """Gives back the memory of a part of the response that the client has."""
        size = min(size, self._memory)
        self._memory -= size
        self._count_memory(self._memory, is_response=True)
        self.threads.hold(-size)

    def share_response(self) -> None:
        """Counts the response no longer for the caller: all who read it count it for themselves."""
        self._count_memory(self._memory, is_response=False)

    def _count_memory(self, size: int, *, is_response: bool) -> None:
        """Sets the bytes that have passed a claim, and those that the caller has not read."""
        passed = min(self._passed, size)
        self.threads.passed_bytes += passed - self._passed
        self._passed = passed
        unread = size if is_response and size > MAX_BUFFERED else 0
        growth, self._unread = unread - self._unread, unread
        if growth:
            self.threads.unread.add(self.caller, growth)

    def close(self) -> None:
        """Ends the computation, and cancels its work in threads."""
        self.cancellation.cancel()
        accounts = self.threads.accounts
        # Seconds on the event loop matter only beside other work, or for a limit.
        if self._inline_seconds and (accounts.active or accounts.limit is not None):
            accounts.charge(self.caller, self._inline_seconds)
        while callbacks := self.on_end or self.on_ready:
            callbacks.pop()()
        self._is_over = True
        self._end()

    @asynccontextmanager
    async def until_deadline(self) -> AsyncIterator[None]:
        """Ends the `with` block at the request's deadline, or when its client disconnects.

        Raises
        ------
        OutOfTime, ClientDisconnect
        """
        receive, self._receive = self._receive, None
        if receive is None:
            # A shared computation, or a block inside another `until_deadline` block.
            yield
            return
        if self._deadline == math.inf:
            self._deadline = current_time() + self.threads.request_timeout
            self.cancellation.deadline = time.monotonic() + self.threads.request_timeout
        has_disconnected = False

        async def watch() -> None:
            nonlocal has_disconnected
            while (await receive())["type"] != "http.disconnect":
                await asyncio.sleep(0)  # the rest of a body that the request does not need
            has_disconnected = True
            scope.cancel()

        with CancelScope(deadline=self._deadline) as scope:
            watcher = asyncio.create_task(watch())
            try:
                yield
            except Cancelled:
                raise ClientDisconnect from None
            finally:
                self._receive = receive
                watcher.cancel()
        if scope.cancelled_caught:
            raise ClientDisconnect if has_disconnected else OutOfTime

    async def _in_thread(self, call: Callable[[], Result], release: Callable[[], None]) -> Result:
        """Returns the result of `call()`, run in a thread; calls `release` at the thread's end."""
        run = to_thread.run_sync(_run_catching, call, limiter=self.threads.limiter)
        # The task inherits this context and hands it to the thread.
        with cancelled_by(self.cancellation):
            task = asyncio.create_task(run)
        self._running.add(task)

        def finish_task(task: asyncio.Task[Any]) -> None:
            self._running.discard(task)
            if not task.cancelled():
                task.exception()  # asyncio would log an error that no request has read
            release()
            if self._is_over:
                self._end()

        task.add_done_callback(finish_task)
        result, error = await asyncio.shield(task)
        if error is not None:
            try:
                raise error
            finally:
                del error, task  # they refer to this frame
        return cast(Result, result)

    def _end(self) -> None:
        if not self._running:
            if self._body or self._memory:
                self.finish_work(0)
            if self._peak >= TRIM_BYTES:
                self.threads.trim()


def _run_catching(call: Callable[[], Result]) -> tuple[Result | None, Exception | None]:
    """Returns the result of `call` or its error, after clearing the local variables of its frames.

    An error that passes from thread to thread is part of a reference cycle: otherwise its frames
    would keep arrays as large as a mesh until the garbage collector runs.
    """
    try:
        return call(), None
    except Exception as error:
        clear_frames(error.__traceback__)  # except this frame, which runs
        del call
        return None, error
