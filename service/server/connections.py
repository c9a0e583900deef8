"""The connections of one server: what they have in common."""

from typing import Protocol


class Connection(Protocol):
    """What is asked of a connection."""

    @property
    def is_idle(self) -> bool:
        """Whether nothing of a request has arrived, and no answer is under way."""

    def drain(self) -> None:
        """Makes an answer that has not begun yet the last."""

    def close(self) -> None:
        """Ends it, once what was written has been taken."""

    def abort(self) -> None:
        """Ends it, and forgets what was written."""


class Connections:
    """All connections that are open."""

    def __init__(self) -> None:
        self.all: set[Connection] = set()
        self.draining = False
        """Whether every answer from now on is the last of its connection."""

    def __len__(self) -> int:
        return len(self.all)

    def drain(self) -> None:
        """Makes every answer that has not begun yet the last of its connection."""
        self.draining = True
        for each in self.all:
            each.drain()

    def close_idle(self) -> None:
        """Ends all that are idle."""
        for each in [each for each in self.all if each.is_idle]:
            each.close()

    def abort(self) -> None:
        """Ends all at once."""
        for each in list(self.all):
            each.abort()
