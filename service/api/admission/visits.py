"""What a request has of memory and threads, until when it may go on, and how it ends."""

import asyncio
import time
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import (
    AbstractContextManager,
    ExitStack,
    asynccontextmanager,
    closing,
    contextmanager,
)
from contextvars import ContextVar
from traceback import clear_frames
from typing import Any, TypeVar, cast

from anyio import CancelScope, current_time, to_thread
from starlette.requests import ClientDisconnect, Request
from starlette.types import ASGIApp, Receive, Scope, Send

from service.api.admission.admission import Admission, Lane
from service.api.admission.arrivals import Arrival
from service.api.admission.pool import Lease
from service.stopping import OutOfTime, Stop, Stopped, stopped_by

Result = TypeVar("Result")


class Visit:
    """What one request has, or work that several wait for. All is given back at its end.

    What a thread still uses is given back as soon as the thread has ended: it may take half a
    second to notice that it shall.

    Attributes
    ----------
    stop : Stop
        Ends what is computed for it.
    arrival : Arrival
        The memory of its body.
    memory : Lease or None
        The memory that it works in; in the end, that of its answer.
    had_turn : bool
        Whether it was its turn on the event loop.
    """

    def __init__(self, admission: Admission) -> None:
        self.admission = admission
        self.stop = Stop()
        self.arrival = Arrival(admission)
        self.memory: Lease | None = None
        self.had_turn = False
        self._most = 0
        self._thread: Lease | None = None
        self._until_end = ExitStack()
        self._while_working = ExitStack()
        self._running: set[asyncio.Task[Any]] = set()
        self._is_over = False

    @contextmanager
    def current(self) -> Iterator[None]:
        """What is done within, and in tasks that are begun within, is part of it."""
        token = _current.set(self)
        try:
            yield
        finally:
            _current.reset(token)

    def until_end(self, callback: Callable[[], None]) -> None:
        """What is done at the end, when the answer has been sent or nobody waits for it."""
        self._until_end.callback(callback)

    def use(self, what: AbstractContextManager[None]) -> None:
        """Leaves this context at the end."""
        self._until_end.enter_context(what)

    def while_working(self, callback: Callable[[], None]) -> None:
        """What is done when the answer is there, or at the end."""
        self._while_working.callback(callback)

    async def thread(self, lane: Lane) -> None:
        """Waits until it is this one's turn to have a thread; one of another lane is given back."""
        if self._thread is not None:
            if self._thread.pool is lane.threads:
                return
            self._thread.release()
        self._thread = await lane.threads.lent(1)

    async def thread_to_parse(self) -> None:
        """The same of a thread in which a long body is parsed."""
        if self.arrival.lodges:
            self._thread = await self.admission.parsing.lent(1)
        else:
            await self.thread(self.admission.large)

    async def room(self, lane: Lane, to: int) -> None:
        """Waits until there is so much memory to work in."""
        if self.memory is None or self.memory.pool is not lane.memory:
            self.no_room()
            self.memory = Lease(lane.memory)
        await self.memory.grown(to)

    def no_room(self) -> None:
        """Gives back the memory to work in."""
        if self.memory is not None:
            self.memory.release()

    async def in_thread(self, work: Callable[[], Result]) -> Result:
        """What `work` returns; it runs in the thread that is had."""
        run = to_thread.run_sync(_settled, work, limiter=self.admission.all_threads)
        with stopped_by(self.stop):  # the task has this context, and hands it to the thread
            task = asyncio.create_task(run)
        self._running.add(task)
        task.add_done_callback(self._returned)
        result, error = await asyncio.shield(task)
        if error is not None:
            try:
                raise error
            finally:
                del error, task  # they have this frame
        return cast(Result, result)

    def rest(self) -> None:
        """Gives back the thread, for the time being."""
        if self._thread is not None:
            self._thread.release()
            self._thread = None

    def worked(self, answer: int) -> None:
        """The answer is there, of so many bytes: all else is given back."""
        self._while_working.close()
        working = 0 if self.memory is None else self.memory.amount
        self._most = max(self._most, self.arrival.amount + working)
        self.arrival.release()
        self.rest()
        if self.memory is not None:
            self.memory.shrink(answer)

    def close(self) -> None:
        """Ends it: what is computed is told to stop, and all is given back when it has."""
        self.stop.tell()
        self._until_end.close()
        self._while_working.close()
        self._is_over = True
        self._end()

    def _returned(self, task: asyncio.Task[Any]) -> None:
        self._running.discard(task)
        if not task.cancelled():
            task.exception()  # seen, even where nobody waits for it any more
        if self._is_over:
            self._end()

    def _end(self) -> None:
        if not self._running:
            self.worked(answer=0)
            self.admission.thrift.ended(self._most)


def _settled(work: Callable[[], Result]) -> tuple[Result | None, Exception | None]:
    """What `work` returns, or what it raises, without whatever it had in its hands.

    An error holds the frames that it has passed through, and all in them: arrays as large as a
    mesh. Of those that are handed from thread to thread some frame always holds the error as well,
    and all of it would stay until Python looks for what holds on to itself.
    """
    try:
        return work(), None
    except Exception as error:
        clear_frames(error.__traceback__)  # but this one, which runs
        del work
        return None, error


_current: ContextVar[Visit | None] = ContextVar("visit", default=None)


def visiting() -> Visit:
    """The visit that whoever asks is part of."""
    visit = _current.get()
    assert visit is not None, "outside of a request"
    return visit


class Visits:
    """Around the application: every request is a visit."""

    def __init__(self, app: ASGIApp, admission: Admission) -> None:
        self._app = app
        self._admission = admission

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """One request."""
        visit = Visit(self._admission)
        with closing(visit), visit.current():
            await self._app(scope, receive, send)


@asynccontextmanager
async def attended(request: Request) -> AsyncIterator[None]:
    """What is done within ends when its time is over, or when the client goes away.

    It begins when the body is there.

    Raises
    ------
    OutOfTime, ClientDisconnect
    """
    visit = visiting()
    patience = visit.admission.request_timeout
    visit.stop.deadline = time.monotonic() + patience
    is_gone = False

    async def watch() -> None:
        nonlocal is_gone
        await _gone(request)
        is_gone = True
        scope.cancel()

    with CancelScope(deadline=current_time() + patience) as scope:
        watching = asyncio.create_task(watch())
        try:
            yield
        except Stopped:
            raise ClientDisconnect from None
        finally:
            watching.cancel()
    if scope.cancelled_caught:
        raise ClientDisconnect if is_gone else OutOfTime


async def _gone(request: Request) -> None:
    """Returns when the client has gone away."""
    message = await request.receive()
    while message["type"] == "http.request" and message.get("more_body"):
        message = await request.receive()  # nobody reads the body of a GET
    if message["type"] == "http.request":
        message = await request.receive()
    if message["type"] != "http.disconnect":
        await asyncio.Event().wait()  # never: the server does not tell
