"""A queue for each caller: the caller that has used the fewest thread seconds is served first.

This is deficit round robin with a quantum that goes to 0 (M. Shreedhar and G. Varghese, "Efficient
fair queuing using deficit round-robin", 1996): no work begins for a caller while another that waits
has used less. The costs of work need not be known before.
"""

from collections import deque
from typing import Generic, TypeVar

from service.fair.accounts import Accounts

Entry = TypeVar("Entry")


class FairQueue(Generic[Entry]):
    """Work that waits for one pool of threads or processes, and who holds how many of these.

    Parameters
    ----------
    accounts : Accounts
        Several queues may share one.

    Attributes
    ----------
    held : dict
        For each caller that holds threads of this pool, their number.
    busy_count : int
        Threads that are held.
    waiting : dict
        The waiting work of each caller that has any, in order.
    length : int
        Number of pieces of waiting work.
    """

    def __init__(self, accounts: Accounts) -> None:
        self.accounts = accounts
        self.held: dict[str, int] = {}
        self.busy_count = 0
        self.waiting: dict[str, deque[Entry]] = {}
        self.length = 0

    def add(self, caller: str, entry: Entry) -> None:
        """Adds work behind the other work of its caller."""
        self.accounts.enter(caller)
        self.waiting.setdefault(caller, deque()).append(entry)
        self.length += 1

    def remove(self, caller: str, entry: Entry) -> None:
        """Removes waiting work.

        Raises
        ------
        ValueError
            It waits no longer.
        """
        entries = self.waiting.get(caller, deque())
        entries.remove(entry)
        self.length -= 1
        if not entries:
            del self.waiting[caller]
        self.accounts.leave(caller)

    def in_turn(self) -> list[str]:
        """The callers that wait, in the order in which they are served."""
        return self.accounts.in_turn(self.waiting)

    def first(self, caller: str) -> Entry:
        """The work of a waiting caller that has waited longest."""
        return self.waiting[caller][0]

    def push_out(self, caller: str) -> Entry | None:
        """Removes and returns work in favour of new work of `caller`.

        It is the newest work of the caller with the most waiting work. None if no caller has more
        than `caller` would have: then the new work itself is one too many.
        """
        count = len(self.waiting.get(caller, ())) + 1
        longest = max(self.waiting, key=lambda name: len(self.waiting[name]), default=caller)
        if len(self.waiting.get(longest, ())) <= count:
            return None
        entry = self.waiting[longest][-1]
        self.remove(longest, entry)
        return entry

    def take_thread(self, caller: str) -> None:
        """A thread of the pool begins to work for a caller."""
        self.accounts.enter(caller)
        self.accounts.take_thread(caller)
        self.held[caller] = self.held.get(caller, 0) + 1
        self.busy_count += 1

    def return_thread(self, caller: str) -> None:
        """A thread of the pool has ended its work for a caller."""
        self.busy_count -= 1
        count = self.held[caller] - 1
        if count:
            self.held[caller] = count
        else:
            del self.held[caller]
        self.accounts.return_thread(caller)
        self.accounts.leave(caller)
