"""Errors that only HTTP knows: of queries, headers, bodies, keys, signatures and rates."""

from service.errors import InvalidRequest, Issue, SurfaceError


class InvalidQuery(InvalidRequest):
    """A query parameter is invalid."""


class UnknownSuffix(SurfaceError):
    """No format has this suffix."""


class NotAcceptable(SurfaceError):
    """The service has no format or coding that the client accepts."""


class EngineGone(SurfaceError):
    """The URL names a version of the engine (`engine=…`) that this service does not have."""


class BodyTooSlow(SurfaceError):
    """The body did not arrive in time."""


class BodyTooLarge(SurfaceError):
    """The body has more bytes than the service reads."""


class UnsupportedMediaType(SurfaceError):
    """The body has a type that this call does not read."""


class KeyNeeded(SurfaceError):
    """The call needs a key, and the client sent none."""


class KeyUnknown(SurfaceError):
    """The client sent a key that the service does not know."""


class ScopeNeeded(SurfaceError):
    """The key has no scope that permits the call."""


class SignatureInvalid(SurfaceError):
    """The signature does not belong to this URL."""


class SignatureExpired(SurfaceError):
    """The signature of this URL has expired."""


class RateLimited(SurfaceError):
    """The client made too many requests in a short time."""


class ComputeLimited(SurfaceError):
    """The requests of the client have used too much computing time.

    Attributes
    ----------
    retry_after : int
        Seconds until the caller may use more.
    """

    retry_after = 1


def compute_limited(limit: int, retry_after: int) -> ComputeLimited:
    """The error of a caller that has used more than `limit` thread seconds a minute."""
    error = ComputeLimited(
        Issue(
            "compute_limited",
            "Your requests have used too much computing time.",
            got=f"more than {limit} thread seconds a minute",
            needed=f"a wait of {retry_after} s",
        )
    )
    error.retry_after = retry_after
    return error
