"""Settings from the environment, SURFACE_*, and from the command line; and why not.

They are read once, by the service and by the command line.
"""

import logging
import os
import re
from collections.abc import Mapping
from typing import Any

from platformdirs import user_data_path
from pydantic import ByteSize, ValidationError
from pydantic.fields import FieldInfo
from pydantic_settings import BaseSettings, SettingsConfigDict

from service.errors import InvalidSettings
from service.settings.listening import PREFIX
from service.settings.values import Settings

EVERYTHING = 1 << 45
"""More memory than a machine has."""

_log = logging.getLogger(__name__)

_OF_CLIENTS = frozenset({f"{PREFIX}KEY"})
"""Variables of the command line as a client: a machine that serves may have them too."""


class _FromEnvironment(Settings, BaseSettings):
    """Settings from arguments first, then from variables. Files are the shell's business."""

    model_config = SettingsConfigDict(env_prefix=PREFIX)


def from_environment() -> Settings:
    """Settings from variables such as SURFACE_MAX_BODY_BYTES; the others keep their defaults.

    Lists are comma-separated. A variable of an unknown name is reported in the log, not refused:
    Kubernetes sets some of its own for a Service that is called "surface".

    Raises
    ------
    InvalidSettings
        Naming every variable that makes no sense, what it holds, and what it may hold.
    """
    known = {variable(name) for name in Settings.model_fields}
    for name in sorted(os.environ):
        if name.startswith(PREFIX) and name not in known | _OF_CLIENTS:
            _log.warning("%s is not a setting of this service", name)
    folder = {"store": str(user_data_path("surface-service", appauthor=False))}
    given: dict[str, Any] = {} if variable("store") in os.environ else folder
    texts = {name: os.environ.get(variable(name), "") for name in Settings.model_fields}
    try:
        found = _FromEnvironment(**given)
    except ValidationError as error:
        raise _refusal(error, texts, {name: variable(name) for name in texts}) from None
    return Settings(**found.model_dump())


def for_one_command() -> Settings:
    """Settings for a command that computes by itself, on a machine that it need not share.

    It takes as much memory as there is, unless the variable says how much.

    Raises
    ------
    InvalidSettings
    """
    settings = from_environment()
    if variable("memory_bytes") in os.environ:
        return settings
    return settings.model_copy(update={"memory_bytes": EVERYTHING})


def with_flags(settings: Settings, flags: Mapping[str, str]) -> Settings:
    """The settings with those that the command line gives: flags by their names, such as "port".

    Raises
    ------
    InvalidSettings
        Naming the flag, what it holds and what it may hold, as for a variable.
    """
    try:
        return Settings(**{**settings.model_dump(), **flags})
    except ValidationError as error:
        raise _refusal(error, flags, {name: f"--{name}" for name in flags}) from None


def variable(name: str) -> str:
    """The environment variable of a setting."""
    return PREFIX + name.upper()


_BYTES = "bytes, such as 1048576 or 64MiB,"
_NUMBERS: dict[object, str] = {int: "a whole number", float: "seconds", ByteSize: _BYTES}


def values(field: FieldInfo) -> str:
    """What a setting may be, in words."""
    if field.annotation is bool:
        return "true or false"
    if kind := _NUMBERS.get(ByteSize if ByteSize in field.metadata else field.annotation):
        least = _bound(field, "ge")
        # A length of time may be short, but not nothing.
        begin = f"from {least}" if least is not None else "above 0"
        return f"{kind} {begin}{' ' if least is not None else ', '}to {_bound(field, 'le')}"
    if field.annotation is str:
        return "a text" if not field.is_required() and field.default == "" else "a text, not empty"
    words = re.findall(r"'(\w+)'", str(field.annotation))
    return f"one of {', '.join(words)}" if words else "a comma-separated list"


def _bound(field: FieldInfo, name: str) -> object:
    return next((getattr(part, name) for part in field.metadata if hasattr(part, name)), None)


def _refusal(
    error: ValidationError, texts: Mapping[str, str], places: Mapping[str, str]
) -> InvalidSettings:
    """One line for each setting that makes no sense; what is secret is not repeated."""
    lines = []
    for name in dict.fromkeys(str(each["loc"][0]) for each in error.errors()):
        field = Settings.model_fields[name]
        secret = "SecretStr" in str(field.annotation)
        got = "something else" if secret else repr(texts[name]) if texts[name] else "nothing"
        lines.append(f"{places[name]}: got {got}, needed {values(field)}.")
    return InvalidSettings("\n".join(lines))
