"""Accounts: the thread seconds that each caller has used, compared with those of the others.

A caller is *active* while its work waits or holds a thread. Work is charged while it runs, because
its time is not known before. One `Accounts` serves all queues of a process: work in
threads and work in processes of jobs are charged to the same accounts.
"""

import time
from collections import OrderedDict
from collections.abc import Iterable, Iterator
from contextlib import contextmanager

from service.fair.compute_limit import ComputeLimit

MAX_CALLERS = 20_000
"""The most callers with an account; beyond it, those that have been idle longest are forgotten."""


class Accounts:
    """Thread seconds by caller.

    A caller that becomes active begins with the least use of the active callers, if its own is
    less: no caller saves up seconds while idle. If its own use is more, that is a debt, which lasts
    until the others have caught up. When no caller is active, all accounts are forgotten, because
    no work waits for a debt to be paid.

    Parameters
    ----------
    limit : ComputeLimit, optional
        Is charged with the same seconds.

    Attributes
    ----------
    active : dict
        For each active caller, the number of its pieces of work that wait or hold a thread.
    """

    def __init__(self, limit: ComputeLimit | None = None) -> None:
        self.limit = limit
        self.active: dict[str, int] = {}
        self._held: dict[str, int] = {}
        self._used: OrderedDict[str, float] = OrderedDict()
        self._charged_at = 0.0

    def __len__(self) -> int:
        return len(self._used)

    def enter(self, caller: str) -> None:
        """Counts a piece of work that begins to wait, or to hold a thread without waiting."""
        count = self.active.get(caller, 0)
        if not count:
            self._begin_account(caller)
        self.active[caller] = count + 1

    def leave(self, caller: str) -> None:
        """Counts a piece of work that neither waits nor holds a thread any more."""
        count = self.active[caller] - 1
        if count:
            self.active[caller] = count
            return
        del self.active[caller]
        if not self.active:
            self._used.clear()

    def take_thread(self, caller: str) -> None:
        """Begins to charge an active caller for a thread."""
        self.charge_running()
        self._held[caller] = self._held.get(caller, 0) + 1

    def return_thread(self, caller: str) -> None:
        """Ends the charge for a thread."""
        self.charge_running()
        count = self._held[caller] - 1
        if count:
            self._held[caller] = count
        else:
            del self._held[caller]

    @contextmanager
    def pause(self, caller: str) -> Iterator[None]:
        """Does not charge for one thread of a caller in the `with` block, because it waits."""
        self.return_thread(caller)
        try:
            yield
        finally:
            self.take_thread(caller)

    def charge(self, caller: str, seconds: float) -> None:
        """Charges work that has been done without a thread of its own, or elsewhere."""
        if self.limit is not None:
            self.limit.spend(caller, seconds)
        if self.active:
            if caller not in self.active:
                self._begin_account(caller)
            self._used[caller] += seconds

    def charge_running(self) -> None:
        """Charges all held threads up to now."""
        now = time.monotonic()
        seconds, self._charged_at = now - self._charged_at, now
        for caller, count in self._held.items():
            self._used[caller] += seconds * count
            if self.limit is not None:
                self.limit.spend(caller, seconds * count, seconds)

    def in_turn(self, callers: Iterable[str]) -> list[str]:
        """These active callers, the one that has used least first; equal ones keep their order."""
        self.charge_running()
        return sorted(callers, key=self._used.__getitem__)

    def _begin_account(self, caller: str) -> None:
        """Opens the account of a caller that is not active, or raises it to the least use."""
        self.charge_running()
        least = min((self._used[other] for other in self.active), default=0.0)
        self._used[caller] = max(self._used.pop(caller, 0.0), least)  # moves to the end
        if len(self._used) > MAX_CALLERS:
            idle = next(name for name in self._used if name not in self.active)
            if idle != caller:
                del self._used[idle]
