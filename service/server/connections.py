"""The connections of one server: what each of them waits for, and for how long it may.

Times are looked at together, about once a second, rather than each by a timer of its own: most end
long before, and a request should not pay for what is hardly ever needed. Within each of the queues
all have the same time, so that the first is the one whose time is up first.
"""

import asyncio
from collections.abc import Callable, Iterator
from math import ceil
from operator import itemgetter
from typing import Protocol

from service.settings.values import Settings

MIB = 1 << 20

LINGERING = 5.0
"""Seconds for which a connection that was refused is still read, so that its answer arrives."""

REFUSED_AT_ONCE = 64
"""Connections beyond those that there may be that are told so; any others are closed at once."""


class Connection(Protocol):
    """What is asked of a connection."""

    @property
    def is_answering(self) -> bool:
        """Whether an answer is awaited, or has not been taken as a whole."""

    def time_is_up(self) -> None:
        """It has been in its queue for as long as it may."""

    def unsent(self) -> int:
        """Bytes that were written and have not been taken."""

    def close(self) -> None:
        """Ends it, once what was written has been taken."""

    def give_up(self) -> None:
        """Ends it because the process does; tells whoever waits for an answer."""

    def abort(self) -> None:
        """Ends it, and forgets what was written."""


class Connections:
    """All connections that are open.

    Parameters
    ----------
    settings : Settings
    refused : callable
        Told the code of what was refused before it became a request.

    Attributes
    ----------
    draining : bool
        Whether every answer from now on is the last of its connection.
    silent, arriving, idle : dict
        Queues: nothing has ever arrived; a part of a request has; an answer has been given. Since
        when, on the clock of the event loop.
    taking : dict
        Until when the clients must have taken what was written.
    """

    def __init__(self, settings: Settings, refused: Callable[[str], None] | None = None) -> None:
        self.settings = settings
        self.refused = refused or _nobody
        self.draining = False
        self.silent: dict[Connection, float] = {}
        self.arriving: dict[Connection, float] = {}
        self.idle: dict[Connection, float] = {}
        self.taking: dict[Connection, float] = {}
        self._all: set[Connection] = set()
        shortest = min(settings.head_timeout, settings.keep_alive, settings.send_timeout)
        self._pause = min(1.0, shortest / 4)
        self._timer: asyncio.TimerHandle | None = None

    def __len__(self) -> int:
        return len(self._all)

    def add(self, connection: Connection, loop: asyncio.AbstractEventLoop) -> bool:
        """Takes a newcomer, for whom the longest idle one goes if there are too many.

        False if none is idle: the newcomer is one too many.
        """
        self._all.add(connection)
        if self._timer is None:
            self._timer = loop.call_later(self._pause, self._look, loop)
        if len(self._all) <= self.settings.max_connections:
            return True
        firsts = [next(iter(queue.items())) for queue in (self.silent, self.idle) if queue]
        if not firsts:
            return False
        longest, _ = min(firsts, key=itemgetter(1))
        longest.close()
        return True

    @property
    def is_crowded(self) -> bool:
        """Whether even those who are told that there are too many are too many."""
        return len(self._all) > self.settings.max_connections + REFUSED_AT_ONCE

    def remove(self, connection: Connection) -> None:
        """Forgets one that is closed."""
        self._all.discard(connection)
        for queue in (self.silent, self.arriving, self.idle, self.taking):
            queue.pop(connection, None)

    def time_to_take(self, length: int) -> float:
        """Seconds in which so many bytes have to be taken."""
        return self.settings.send_timeout * max(1, ceil(length / MIB))

    def look(self, now: float) -> None:
        """Ends what has taken too long."""
        settings = self.settings
        for queue, seconds in (
            (self.silent, settings.head_timeout),
            (self.arriving, settings.head_timeout),
            (self.idle, settings.keep_alive),
        ):
            for each in list(_before(queue, now - seconds)):
                each.time_is_up()
        # The rest of an answer may be so short that nobody waits for it, and yet not be taken.
        for each in list(_before(self.idle, now - settings.send_timeout)):
            if each.unsent():
                each.abort()
        for each in [each for each, end in self.taking.items() if end < now]:
            each.abort()

    def _look(self, loop: asyncio.AbstractEventLoop) -> None:
        self.look(loop.time())
        self._timer = loop.call_later(self._pause, self._look, loop) if self._all else None

    @property
    def are_answering(self) -> bool:
        """Whether any client waits for an answer, or is still taking one."""
        return any(each.is_answering for each in self._all)

    def close_idle(self) -> None:
        """Ends all that are idle."""
        for each in [*self.silent, *self.idle]:
            each.close()

    def give_up(self) -> None:
        """Ends all because the process does."""
        for each in list(self._all):
            each.give_up()


def _nobody(code: str) -> None:
    """Nobody is told."""


def _before(queue: dict[Connection, float], time: float) -> Iterator[Connection]:
    """Those that came into a queue before some time."""
    for each, since in queue.items():
        if since >= time:
            return
        yield each
