"""Settings from the environment, SURFACE_*: read once, by the service and the command line."""

import logging
import os
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from types import MappingProxyType
from typing import Any

import numpy as np  # noqa: F401  (its BLAS must be loaded before it can be told anything)
from platformdirs import user_data_path
from threadpoolctl import threadpool_limits

from service.pipeline.limits import Limits
from service.schemas.document import DocumentLimits
from service.surface.checks import MAX_DEGREE

PREFIX = "SURFACE_"
_log = logging.getLogger(__name__)


class InvalidSettings(ValueError):
    """A variable or a flag makes no sense; the service must not start."""


@dataclass(frozen=True, slots=True)
class Settings:
    """What an operator may choose. Sizes are bytes, times are seconds."""

    host: str = "127.0.0.1"
    port: int = 8000
    max_body_bytes: int = 64 << 20
    body_timeout: int = 60
    max_control_points: int = DocumentLimits().max_control_points
    max_degree: int = DocumentLimits().max_degree
    max_vertices: int = Limits().max_vertices
    max_response_bytes: int = Limits().max_bytes
    max_points: int = Limits().max_points
    threads: int = 0
    """Surfaces evaluated at the same time off the event loop; 0 takes the number of cores."""
    cors_origins: tuple[str, ...] = ("*",)
    """Origins whose pages may read answers; none switches CORS off."""
    store: str = "memory://"
    """Where surfaces are kept: a folder, `memory://`, or the address of a bucket, `s3://…`.

    An environment that names none means the user's data folder.
    """
    store_quota: int = 10 << 30
    """Bytes that all stored surfaces may take together; 0 sets no limit."""
    allow_delete: bool = False
    """Whether stored surfaces may be deleted over HTTP."""
    cache_bytes: int = 128 << 20
    """Encoded answers that are kept in memory, to be sent again; 0 keeps none.

    What is not kept is not compressed, either.
    """

    def __post_init__(self) -> None:
        for name in _RANGES:
            _check_range(PREFIX + name.upper(), name, getattr(self, name))

    @property
    def workers(self) -> int:
        """Number of threads, with 0 resolved."""
        return self.threads or os.cpu_count() or 1


_RANGES = MappingProxyType(
    {
        "port": (0, 65535),
        "max_body_bytes": (1024, 1 << 32),
        "body_timeout": (1, 3600),
        "max_control_points": (4, 100_000_000),
        "max_degree": (1, MAX_DEGREE),
        "max_vertices": (4, 1 << 32),
        "max_response_bytes": (1024, 1 << 32),
        "max_points": (1, 1 << 32),
        "threads": (0, 1024),
        "store_quota": (0, 1 << 50),
        "cache_bytes": (0, 1 << 40),
    }
)

_SWITCHES = MappingProxyType({"1": True, "true": True, "0": False, "false": False})


def from_environment(environment: Mapping[str, str] = os.environ) -> Settings:
    """Settings from variables such as SURFACE_MAX_BODY_BYTES; the others keep their defaults.

    Lists are comma-separated. A variable of an unknown name is reported in the log, not refused:
    Kubernetes sets some of its own for a Service that is called "surface".

    Raises
    ------
    InvalidSettings
        Naming the variable, what it holds and what it may hold.
    """
    chosen: dict[str, Any] = {}
    known = {PREFIX + field.name.upper(): field for field in fields(Settings)}
    for variable, text in sorted(environment.items()):
        if not variable.startswith(PREFIX):
            continue
        if variable not in known:
            _log.warning("%s is not a setting of this service", variable)
            continue
        field = known[variable]
        chosen[field.name] = _parsed(variable, text, field.type)
    chosen.setdefault("store", str(user_data_path("surface-service", appauthor=False)))
    return Settings(**chosen)


def with_flags(settings: Settings, flags: Mapping[str, str]) -> Settings:
    """The settings with those that the command line gives: flags by their names, such as "port".

    Raises
    ------
    InvalidSettings
        Naming the flag, what it holds and what it may hold, as for a variable.
    """
    kinds = {field.name: field.type for field in fields(Settings)}
    chosen: dict[str, Any] = {}
    for name, text in flags.items():
        chosen[name] = _parsed(f"--{name}", text, kinds[name])
        if name in _RANGES:
            _check_range(f"--{name}", name, chosen[name])
    return replace(settings, **chosen)


def _check_range(place: str, name: str, value: int) -> None:
    low, high = _RANGES[name]
    if not low <= value <= high:
        raise InvalidSettings(f"{place}: got {value}, needed {low} to {high}.")


def _parsed(place: str, text: str, kind: object) -> bool | int | str | tuple[str, ...]:
    """The value of a text that stands at `place`, a variable or a flag."""
    if kind is bool:
        if text.lower() not in _SWITCHES:
            raise InvalidSettings(f"{place}: got {text!r}, needed true or false.")
        return _SWITCHES[text.lower()]
    if kind is int:
        try:
            return int(text)
        except ValueError:
            raise InvalidSettings(f"{place}: got {text!r}, needed a whole number.") from None
    if kind is str:
        if not text:
            raise InvalidSettings(f"{place}: got nothing, needed a name or an address.")
        return text
    return tuple(part.strip() for part in text.split(",") if part.strip())


def document_limits(settings: Settings) -> DocumentLimits:
    """The settings that the language of requests needs."""
    return DocumentLimits(settings.max_control_points, settings.max_degree)


def result_limits(settings: Settings) -> Limits:
    """The settings that the pipeline needs."""
    return Limits(settings.max_vertices, settings.max_response_bytes, settings.max_points)


def pin_blas() -> None:
    """Keeps BLAS on one thread for the rest of the process.

    The matrices of a surface are small: more threads only wait for each other, and under load
    the slowest requests take twenty times as long.
    """
    threadpool_limits(limits=1, user_api="blas")
