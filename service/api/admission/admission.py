"""What there is to share: memory in pools, threads in lanes.

Who has a thread may wait for memory, and who has memory of the one kind, a body, may wait for
memory of the other; nobody waits the other way round. Of those who have some of the memory to work
in, one alone may wait for more while it plans, and a body that takes some of it waits for nobody
who may. Answers that are to be compressed are not, where that would have to wait for memory; should
others be quicker than that was seen, the deadline of the request ends the wait.
"""

import math

from anyio import CapacityLimiter, Lock

from service.api.admission.busy import Busy
from service.api.admission.pool import Pool, Tenant
from service.api.admission.thrift import Thrift
from service.settings.values import Settings, result_limits

SMALL = 12
"""One part of so many of the memory is for small requests alone."""

SINGLE = 8
"""A request is small if it takes one part of so many of that, or less."""

FREE_ARRIVAL = 1 << 20
"""Bodies that take up to so much as documents have room that larger ones leave them."""

LEFT = 10
"""That room is one part of so many of what is for bodies."""

LONGEST = 60
"""Seconds after which a client may come again at the latest."""


class Lane:
    """Threads, and memory to work in.

    Attributes
    ----------
    threads, memory : Pool
    planning : Pool
        Of one: the turn to find out how much memory is needed, some of which that takes itself.
    """

    def __init__(
        self, threads: int, memory: int, max_queue: int, tenant: Tenant | None = None
    ) -> None:
        self.threads = Pool(threads, max_queue)
        self.memory = Pool(memory, max_queue, tenant)
        self.planning = Pool(1)
        self._max_queue = max_queue

    @property
    def waiting(self) -> int:
        """Requests that wait for a thread or for memory."""
        # Who waits for a turn waits for memory, if that is what the one who has it waits for.
        behind = self.planning.waiting if self.memory.waiting else 0
        return self.threads.waiting + self.memory.waiting + behind

    def check(self) -> None:
        """Refuses one more who would wait for memory.

        Raises
        ------
        Busy
        """
        if self.memory.waiting and self.waiting >= max(1, self._max_queue):
            self.memory.refused += 1
            raise Busy


class Admission:
    """The memory and the threads of the service.

    Attributes
    ----------
    large, small : Lane
        Small requests have a lane of their own: they never wait because of large ones, nor because
        of those who take their time to fetch large answers.
    arriving : Pool
        Memory for bodies and the documents that they become. Nobody waits for it.
    """

    def __init__(self, settings: Settings, tenant: Tenant | None = None) -> None:
        whole = settings.memory_bytes
        working = result_limits(settings).max_memory
        small = whole // SMALL
        self.capacity = whole
        self.thrift = Thrift()
        self.turn = Lock()
        """Short work on the event loop takes turns."""
        self.parsing = Pool(1)
        """A thread for bodies that take of the memory to work in: were they to wait for one of a
        lane, those who have them might wait for just that memory."""
        self.all_threads = CapacityLimiter(2 * settings.workers + 2)
        """Nobody waits here who has a thread of the pools; one is for what is done once."""
        self.request_timeout = settings.request_timeout
        self.large = Lane(settings.workers, working, settings.max_queue, tenant)
        self.small = Lane(settings.workers, small, settings.max_queue)
        self.arriving = Pool(whole - working - small)
        self.small_bytes = small // SINGLE
        """What a small request takes at most."""

    @property
    def lanes(self) -> tuple[Lane, Lane]:
        """Both of them."""
        return self.large, self.small

    @property
    def used(self) -> int:
        """Bytes that are lent; what is kept of answers is not among them."""
        return self.arriving.used + sum(lane.memory.used for lane in self.lanes)

    @property
    def waiting(self) -> int:
        """Requests that wait for a thread or for memory."""
        return sum(lane.waiting for lane in self.lanes)

    @property
    def computing(self) -> int:
        """Threads that compute, or are about to."""
        return self.parsing.used + sum(lane.threads.used for lane in self.lanes)

    @property
    def refused(self) -> int:
        """Requests that were refused because others take the room."""
        lanes = sum(lane.threads.refused + lane.memory.refused for lane in self.lanes)
        return self.arriving.refused + lanes

    @property
    def seconds_waited(self) -> float:
        """How long all requests together have waited."""
        return sum(lane.threads.seconds + lane.memory.seconds for lane in self.lanes)

    def has_room(self, amount: int) -> bool:
        """Whether so much memory to work in could be had without waiting, as things are."""
        lane = self.small if amount <= self.small_bytes else self.large
        return not lane.planning.used and not lane.waiting and lane.memory.has(amount)

    def retry_after(self) -> int:
        """Seconds after which coming again makes sense: one for each round of those who wait."""
        rounds = math.ceil(self.large.waiting / self.large.threads.capacity)
        return min(1 + rounds, LONGEST)
