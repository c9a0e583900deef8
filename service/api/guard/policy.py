"""What a request needs: nothing, or a key; told by its method and its path alone."""

from typing import Literal, TypeAlias

from service.settings.values import Settings

Need: TypeAlias = Literal["nothing", "key", "key or signature"]

READING = frozenset({"GET", "HEAD", "OPTIONS"})
"""Methods that change nothing, and compute only what has an address."""

METRICS = "/metrics"

EXEMPT = frozenset({"/health", "/health/live", "/health/ready", METRICS})
"""Asked by machines that watch the service, and not counted."""

FORMATS = "/v1/formats"

_LISTS = frozenset({FORMATS, "/v1/surfaces"})


def needs_keys(settings: Settings) -> bool:
    """Whether there are keys, so that not everybody may do everything."""
    return bool(settings.api_keys or settings.api_keys_file)


class Policy:
    """The rules, by settings.

    Whatever is not a page, a list or the service's own state is closed where it can be: a new call
    below `/v1` needs a key until somebody decides otherwise.
    """

    def __init__(self, settings: Settings) -> None:
        self.has_keys = needs_keys(settings)
        self._private = not settings.public_reads
        self._metrics = settings.metrics == "key"

    def need(self, method: str, path: str) -> Need:
        """What a request needs to be answered."""
        if method not in READING:
            # Where one can only read, and to whom nobody listens, that is said to everybody.
            heard = path.startswith("/v1/") and path != FORMATS and method != "TRACE"
            return "key" if self.has_keys and heard else "nothing"
        # Whatever begins so: routes match, say, a path with an end of line behind it, too.
        if path.startswith(METRICS) and self._metrics:
            return "key"
        if self._private and path.startswith("/v1/") and path not in _LISTS:
            return "key or signature"
        return "nothing"
