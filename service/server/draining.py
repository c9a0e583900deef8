"""How the service ends: nobody who was let in is left without an answer.

Told by SIGTERM, it first says that it is not ready and goes on answering, so that whatever is in
front has the time to look elsewhere; then it takes no more connections, and waits for what is under
way. SIGINT, which a person sends, has no such delay. Either way the exit code is 0. A second signal
ends the process at once, with 128 and the signal's number, as if it had killed it.
"""

import asyncio
import atexit
import contextvars
import logging
import os
import signal
import socket
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from types import FrameType
from typing import Any, NoReturn

import uvicorn
from uvicorn.server import HANDLED_SIGNALS

from service.server.connections import Connections
from service.server.listening import urls
from service.server.supervisor import notify
from service.settings.values import Settings

PAUSE = 0.02
"""Seconds between two looks at what is still under way."""

LAST_WORDS = 1.0
"""Seconds in which what was cut off may end by itself, and threads too.

As long, at most, is waited for requests of which only a part has arrived, and for clients that were
refused to see it.
"""

_log = logging.getLogger(__name__)


class Server(uvicorn.Server):
    """Uvicorn's server, with an end of its own.

    Parameters
    ----------
    config : uvicorn.Config
    connections : Connections
        Those of the protocol that `config` names.
    settings : Settings
    state : optional
        The application's: its `ready` becomes false with the first signal.
    """

    def __init__(
        self,
        config: uvicorn.Config,
        connections: Connections,
        settings: Settings,
        state: Any = None,
    ) -> None:
        super().__init__(config)
        self._settings = settings
        self._connections = connections
        self._state = state
        self._leaving_at = 0.0
        self._loop: asyncio.AbstractEventLoop | None = None

    @property
    def unfinished(self) -> int:
        """Requests that are still being worked on; after the end, those that it cut off."""
        return len(self.server_state.tasks)

    @contextmanager
    def capture_signals(self) -> Iterator[None]:
        """Listens to signals; unlike uvicorn's, without raising them again at the end."""
        self._loop = asyncio.get_running_loop()
        if threading.current_thread() is not threading.main_thread():
            yield
            return
        before = {each: signal.signal(each, self.handle_exit) for each in HANDLED_SIGNALS}
        try:
            yield
        finally:
            for each, handler in before.items():
                signal.signal(each, handler)

    def handle_exit(self, sig: int, frame: FrameType | None) -> None:
        """A signal, between any two instructions: what can wait is left to the event loop."""
        del frame
        if self.should_exit:
            os._exit(128 + sig)
        delay = self._settings.drain_delay if sig == signal.SIGTERM else 0.0
        self._leaving_at = time.monotonic() + delay
        self.should_exit = True
        self._connections.draining = True
        if self._state is not None:
            self._state.ready = False
        if self._loop is not None:
            # Whatever request the signal interrupts, the log shall not name it.
            context = contextvars.Context()
            self._loop.call_soon_threadsafe(self._announce, sig, delay, context=context)

    def _announce(self, sig: int, delay: float) -> None:
        notify("STOPPING=1")
        name = signal.Signals(sig).name
        _log.info("Told to stop by %s; all is answered for another %g s", name, delay)

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        """Starts the application, then answers; says so to whoever asked."""
        await super().startup(sockets)
        if self.started and sockets:
            _log.info("Answering at %s", ", ".join(urls(sockets)))
            notify("READY=1")

    async def on_tick(self, counter: int) -> bool:
        """Ten times a second: whether it is time to leave."""
        return await super().on_tick(counter) and time.monotonic() >= self._leaving_at

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """Takes no more connections, lets end what is under way, and ends the application."""
        self._connections.draining = True
        for listener in (*self.servers, *(sockets or ())):
            listener.close()
        seconds = self._settings.drain_timeout
        try:
            async with asyncio.timeout(seconds):
                await self._nothing_under_way()
        except TimeoutError:
            if self.unfinished:
                _log.warning("%d requests were cut off after %g s", self.unfinished, seconds)
        self._connections.give_up()
        with suppress(TimeoutError):
            # What was cut off learns it now; work that nobody waits for any more ends by itself.
            async with asyncio.timeout(LAST_WORDS):
                while self.server_state.tasks:
                    await asyncio.sleep(PAUSE)
        await self.lifespan.shutdown()

    async def _nothing_under_way(self) -> None:
        patience = time.monotonic() + LAST_WORDS
        while True:
            self._connections.close_idle()
            under_way = self.server_state.tasks or self._connections.are_answering
            if not under_way and (not self._connections or time.monotonic() >= patience):
                return
            await asyncio.sleep(PAUSE)


def end_process(code: int = 0) -> NoReturn:
    """Ends the process whatever its tasks and threads do: Python would wait for all of them."""
    atexit._run_exitfuncs()  # the last lines of the log, say
    for stream in (sys.stdout, sys.stderr):
        with suppress(OSError, ValueError, AttributeError):
            stream.flush()
    os._exit(code)


def end_threads() -> None:
    """Waits a moment for the threads that the end of Python would wait for; then ends without."""
    end = time.monotonic() + LAST_WORDS
    waited_for = [each for each in threading.enumerate() if not each.daemon]
    for thread in waited_for:
        if thread is not threading.current_thread():
            thread.join(max(0.0, end - time.monotonic()))
            if thread.is_alive():
                end_process()
