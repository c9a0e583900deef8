"""Where work is done: short work on the event loop, long work in a thread."""

from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from typing import TypeVar

from anyio import CapacityLimiter, to_thread
from starlette.requests import Request

INLINE_BYTES = 1 << 18
"""Bodies up to this size are parsed in some 5 ms."""

INLINE_OBJECTS = 32
"""Objects in a body up to which that holds; each of a group's members is some of them."""

Result = TypeVar("Result")


def long_to_read(body: bytes) -> bool:
    """Whether the event loop cannot spare the time to parse and check a body."""
    return len(body) > INLINE_BYTES or body.count(b"{") > INLINE_OBJECTS


async def run(request: Request, work: Callable[[], Result], *, in_thread: bool) -> Result:
    """Calls `work`, off the event loop if it is long; so many at a time as there are cores.

    Short work takes turns. The event loop runs whatever is ready before it looks for anything new,
    so hundreds of short works that arrive together would keep it from all else until the last is
    done; a lock is handed on once a round.
    """
    if not in_thread:
        async with request.app.state.turn:
            return work()
    limiter: CapacityLimiter = request.app.state.limiter
    return await to_thread.run_sync(work, limiter=limiter)


@asynccontextmanager
async def one_of_few(request: Request, *, is_long: bool) -> AsyncIterator[None]:
    """A place among the large surfaces that are worked on, as many as there are threads.

    As patches a surface takes ten times the memory of its control points. Who waits here for a
    thread has only these, where each step that waits by itself would have left all of them.
    """
    if not is_long:
        yield
        return
    async with request.app.state.few:
        yield
