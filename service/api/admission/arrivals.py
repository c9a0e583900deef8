"""Memory for a body as it arrives, and for the document that it becomes."""

from collections.abc import Iterator
from contextlib import contextmanager

from anyio import CancelScope, current_time

from service.api.admission.admission import FREE_ARRIVAL, LEFT, Admission
from service.api.admission.busy import Busy
from service.api.admission.pool import Lease
from service.errors import Issue, TooLarge

DOCUMENT_SHARE = 4
"""A document takes so many times the memory of the numbers in it: lists of Python's numbers."""


class Arrival:
    """What one body takes. It never waits: what does not fit right now is refused.

    Where the room for bodies does not do, a body takes of the memory to work in, as long as nobody
    waits for that. So one body may be larger than what is set aside for all, and nobody has to wait
    for one that comes slowly.
    """

    __slots__ = ("_admission", "_lodged", "_own")

    def __init__(self, admission: Admission) -> None:
        self._admission = admission
        self._own = Lease(admission.arriving)
        self._lodged = Lease(admission.large.memory)

    @property
    def amount(self) -> int:
        """Bytes."""
        return self._own.amount + self._lodged.amount

    @property
    def lodges(self) -> bool:
        """Whether some of it is of the memory to work in."""
        return self._lodged.amount > 0

    @contextmanager
    def within(self, seconds: float) -> Iterator[None]:
        """The body arrives meanwhile, and has so long.

        Raises
        ------
        TimeoutError
        Busy
            If somebody began to wait for what it takes of the memory to work in.
        """
        is_awaited, pool = False, self._lodged.pool

        def leave() -> None:
            nonlocal is_awaited
            if self.lodges:
                is_awaited = True
                scope.cancel()

        with CancelScope(deadline=current_time() + seconds) as scope:
            pool.lodgers[leave] = None
            try:
                yield
            finally:
                del pool.lodgers[leave]
        if scope.cancelled_caught:
            if not is_awaited:
                raise TimeoutError
            pool.refused += 1
            raise Busy

    def claim(self, to: int) -> None:
        """Takes so much altogether, if that is more than before.

        Raises
        ------
        TooLarge
            If it would not fit where nobody else is.
        Busy
            If it does not fit right now.
        """
        more = to - self.amount
        if more <= 0:
            return
        pool = self._admission.arriving
        leaving = 0 if to <= FREE_ARRIVAL else pool.capacity // LEFT
        most = pool.capacity - leaving + self._lodged.pool.capacity
        if to > most:
            raise TooLarge(
                Issue(
                    "too_much_memory",
                    "The body would take more memory than this service has for one.",
                    got=f"{to} bytes, and maybe more",
                    needed=f"at most {most}; a smaller surface",
                )
            )
        here = min(more, max(0, pool.capacity - pool.used - leaving))
        if not self._lodged.grow(more - here):
            pool.refused += 1
            raise Busy
        self._own.grow(here)

    def parsed(self) -> None:
        """The document became numbers: those are kept, in the room that is for bodies.

        Raises
        ------
        Busy
            If they do not fit there right now: who waits for memory to work in may have none of it.
        """
        numbers = self.amount // DOCUMENT_SHARE
        self._lodged.release()
        self._own.shrink(numbers)
        if not self._own.grow(numbers - self._own.amount):
            self._admission.arriving.refused += 1
            raise Busy

    def release(self) -> None:
        """Gives all back."""
        self._lodged.release()
        self._own.release()
