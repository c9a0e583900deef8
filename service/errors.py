"""Errors of requests as values and exceptions; this module knows nothing of HTTP.

Every error is a list of `Issue`s: a stable code, a message, a JSON pointer (RFC 6901), and texts
that say what the service got and what it needed. The texts describe the input and never repeat it.
One table in `service.api.problems` maps each class of errors to an HTTP status.
"""

from collections.abc import Iterable
from dataclasses import dataclass, replace

MAX_ISSUES = 20
"""The most issues of one response: enough to correct a request, too few to flood a client."""


@dataclass(frozen=True, slots=True)
class Issue:
    """One error: where it is, what the service got, and what it needed.

    `pointer` is relative to the checked value. A caller that knows where this value is in the
    document puts a prefix before the pointer (`SurfaceError.within`).
    """

    code: str
    message: str
    pointer: str = ""
    got: str = ""
    needed: str = ""


class SurfaceError(Exception):
    """Base of every error that a client may see.

    `issues` are the first `MAX_ISSUES` arguments. An error may have no issues: then its class says
    enough.
    """

    def __init__(self, *issues: Issue) -> None:
        self.issues: tuple[Issue, ...] = issues[:MAX_ISSUES]
        super().__init__("; ".join(issue.message for issue in self.issues))

    def within(self, prefix: str) -> "SurfaceError":
        """A copy of the error in which every pointer begins with `prefix`."""
        return type(self)(*(replace(i, pointer=prefix + i.pointer) for i in self.issues))


class InvalidRequest(SurfaceError):
    """The surface or an option is invalid."""


class MalformedJson(SurfaceError):
    """The body is not one JSON document (RFC 8259)."""


class MalformedBody(SurfaceError):
    """A file is not in the format that its name or media type says."""


class UnknownSurface(SurfaceError):
    """No surface has this id."""


class UnsupportedByFormat(SurfaceError):
    """The format cannot store what the request asks for (quads in STL, lines in OFF, …)."""


class TooLarge(SurfaceError):
    """The result or a body exceeds a limit; mostly the shapes of the request show it beforehand."""


class StoreFull(SurfaceError):
    """The store has no room for another surface."""


class StoreFailed(SurfaceError):
    """The store failed; the log says why."""


class DamagedObject(SurfaceError):
    """A stored object does not have the content that its id names."""


class UnknownJob(SurfaceError):
    """No job has this id, or its results have expired."""


class UnknownResult(SurfaceError):
    """A part of a job has no result: it has not ended, it failed, or there is no such part."""


class TooManyJobs(SurfaceError):
    """The caller has the largest number of jobs that have not ended."""


class JobQuotaFull(SurfaceError):
    """The store has no room for another job and its results."""


class PartCrashed(SurfaceError):
    """The process that computed a part of a job has died, each time that it was tried."""


class InvalidSettings(ValueError):
    """A variable or a flag is invalid; the service must not start."""


class Busy(SurfaceError):
    """Other requests hold the memory or the threads that this request needs."""


class BadAddress(Exception):
    """The URL of a service, or the key that the command has for it, is invalid."""


class ServiceFailed(Exception):
    """The service at `--url` failed, not because of the request."""


def pointer(parts: Iterable[str | int]) -> str:
    """JSON pointer of a path (RFC 6901, section 3), `~` and `/` escaped."""
    return "".join("/" + str(part).replace("~", "~0").replace("/", "~1") for part in parts)


def first_part(json_pointer: str) -> str:
    """The first part of a JSON pointer, unescaped; empty for the whole document."""
    return json_pointer[1:].partition("/")[0].replace("~1", "/").replace("~0", "~")


def format_number(value: float) -> str:
    """A number in six digits if these are exact, otherwise in all its digits.

    `0.3` and `1e+10`, but `0.30000000000000004`: a reader can compare it with the limit 0.3.
    """
    six_digits = f"{value:.6g}"
    return six_digits if float(six_digits) == value else repr(float(value))


_SINGULAR = {
    "axes": "axis",
    "entities": "entity",
    "indices": "index",
    "patches": "patch",
    "vertices": "vertex",
}


def count_nouns(count: int, nouns: str) -> str:
    """A number and its noun: `3 control points`, but `1 control point`.

    Parameters
    ----------
    nouns : str
        The noun in the plural, adjectives before it included.
    """
    if count != 1:
        return f"{count} {nouns}"
    adjectives, space, noun = nouns.rpartition(" ")
    return f"1 {adjectives}{space}{_SINGULAR.get(noun, noun.removesuffix('s'))}"
