"""What can be wrong with a request, as values and exceptions that know nothing of HTTP.

Every error is a list of `Issue`s: a stable code, a JSON pointer (RFC 6901) to the place, what
was got and what was needed. The texts describe the input and never repeat it. One table in
`service.api.problems` maps the classes to status codes.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace

MAX_ISSUES = 20
"""An answer names at most this many issues: enough to mend a request, too few to flood anyone."""


@dataclass(frozen=True, slots=True)
class Issue:
    """One thing that is wrong, where, and what would have been right.

    `pointer` is relative to whatever was being checked; the layer that knows the surrounding
    document puts its own prefix in front (`SurfaceError.within`).
    """

    code: str
    message: str
    pointer: str = ""
    got: str = ""
    needed: str = ""


class SurfaceError(Exception):
    """Base of every error that may be shown to the person who asked.

    Raised with one or more issues; only the first `MAX_ISSUES` are kept.
    """

    def __init__(self, *issues: Issue) -> None:
        self.issues: tuple[Issue, ...] = issues[:MAX_ISSUES]
        super().__init__("; ".join(issue.message for issue in self.issues))

    def within(self, prefix: str) -> "SurfaceError":
        """The same error, its pointers moved below `prefix`."""
        return type(self)(*(replace(i, pointer=prefix + i.pointer) for i in self.issues))


class InvalidRequest(SurfaceError):
    """The surface or an option does not say anything we can compute."""


class MalformedJson(SurfaceError):
    """The body is not one JSON document (RFC 8259)."""


class MalformedBody(SurfaceError):
    """A file that holds control nets is not of the format that it is said to be of."""


class UnknownSurface(SurfaceError):
    """No surface is known by this id."""


class UnsupportedByFormat(SurfaceError):
    """The format cannot hold what was asked for (quads in STL, lines in OFF, …)."""


class TooLarge(SurfaceError):
    """The result would exceed a limit; known from the request's shapes, before any allocation."""


class StoreFull(SurfaceError):
    """There is no room to keep another surface."""


class StoreFailed(SurfaceError):
    """The place where surfaces are kept does not do what it should; the log says why."""


class DamagedObject(SurfaceError):
    """What is kept under an id is not what was stored under it."""


class InvalidSettings(ValueError):
    """A variable or a flag makes no sense; the service must not start."""


class BadAddress(Exception):
    """The address of a service is none."""


class ServiceFailed(Exception):
    """A service that should do the work does not, and it is not the request's fault."""


def pointer(parts: Iterable[str | int]) -> str:
    """JSON pointer of a path (RFC 6901, section 3), `~` and `/` escaped."""
    return "".join("/" + str(part).replace("~", "~0").replace("/", "~1") for part in parts)


def first_part(where: str) -> str:
    """First part of the path that a JSON pointer is, unescaped; empty for the whole document."""
    return where[1:].partition("/")[0].replace("~1", "/").replace("~0", "~")


class Busy(SurfaceError):
    """Other requests hold the memory or the threads that this one needs."""
