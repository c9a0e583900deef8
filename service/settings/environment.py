"""Reads the settings: variables `SURFACE_…` of the environment, and flags of the command line.

The service and the command line read the settings once, at the start.
"""

import logging
import os
import re
from collections.abc import Mapping
from difflib import get_close_matches
from typing import Any

from platformdirs import user_data_path
from pydantic import ValidationError
from pydantic.fields import FieldInfo
from pydantic_settings import BaseSettings, SettingsConfigDict

from service.errors import InvalidSettings
from service.settings.listening import PREFIX
from service.settings.types import PARSE_BYTES
from service.settings.values import Settings

ALL_MEMORY = 1 << 45
"""A limit of memory that has no effect: more bytes than any machine has."""

_log = logging.getLogger(__name__)

_CLIENT_VARIABLES = frozenset({f"{PREFIX}KEY"})
"""Variables that the command reads when it calls another service. The server ignores them without a
warning."""


class _FromEnvironment(Settings, BaseSettings):
    """Settings from arguments, or else from environment variables; `.env` files are not read."""

    model_config = SettingsConfigDict(env_prefix=PREFIX)


def read_environment() -> Settings:
    """The settings from variables such as SURFACE_MAX_BODY_BYTES, or else their defaults.

    Lists are comma-separated. The log names each unknown variable `SURFACE_…`, but the service
    starts: Kubernetes sets variables of this form for a Service with the name "surface".

    Raises
    ------
    InvalidSettings
        Names every invalid variable, its value (except of a secret) and its valid values.
    """
    variables = {variable(name) for name in Settings.model_fields}
    for name in sorted(os.environ):
        if name.startswith(PREFIX) and name not in variables | _CLIENT_VARIABLES:
            suggestion = next(
                iter(get_close_matches(name, variables, 1)), "docs/settings.md lists them all"
            )
            _log.warning("%s is not a setting of this service; perhaps: %s", name, suggestion)
    defaults: dict[str, Any] = {}
    if variable("store") not in os.environ:
        defaults["store"] = str(user_data_path("surface-service", appauthor=False))
    texts = {name: os.environ.get(variable(name), "") for name in Settings.model_fields}
    try:
        settings = _FromEnvironment(**defaults)
    except ValidationError as error:
        raise _settings_error(error, texts, {name: variable(name) for name in texts}) from None
    return Settings(**settings.model_dump())


def command_settings() -> Settings:
    """The settings of a command that computes in its own process.

    The command may use all memory of the machine, unless SURFACE_MEMORY_BYTES sets a limit.

    Raises
    ------
    InvalidSettings
    """
    settings = read_environment()
    if variable("memory_bytes") in os.environ:
        return settings
    return settings.model_copy(update={"memory_bytes": ALL_MEMORY})


def apply_flags(settings: Settings, flags: Mapping[str, str]) -> Settings:
    """The settings, some of them replaced by command-line flags.

    Parameters
    ----------
    flags : Mapping
        Texts by names of settings, such as "port".

    Raises
    ------
    InvalidSettings
        Names the invalid flag, its value and its valid values.
    """
    try:
        return Settings(**{**settings.model_dump(), **flags})
    except ValidationError as error:
        raise _settings_error(error, flags, {name: f"--{name}" for name in flags}) from None


def variable(name: str) -> str:
    """The environment variable of a setting."""
    return PREFIX + name.upper()


def summarize(settings: Settings) -> str:
    """All settings in one line, for the log: `SURFACE_HOST=127.0.0.1 SURFACE_PORT=8000 …`.

    Of keys and secrets it has only the number, and of the store's URL no user and no password.
    """
    return " ".join(
        f"{variable(name)}={_shown(name, field, getattr(settings, name))}"
        for name, field in Settings.model_fields.items()
    )


def _shown(name: str, field: FieldInfo, value: object) -> str:
    """The text of a setting's value, as an operator would write it."""
    if isinstance(value, tuple):
        return f"({len(value)})" if name == "api_keys" or _is_secret(field) else ",".join(value)
    if isinstance(value, bool):
        return str(value).lower()
    return re.sub(r"(?<=://)[^/?#]*@", "", f"{value:g}" if isinstance(value, float) else str(value))


def _is_secret(field: FieldInfo) -> bool:
    return "SecretStr" in str(field.annotation)


_NUMBERS: dict[object, str] = {
    int: "a whole number",
    float: "seconds",
    PARSE_BYTES: "bytes, such as 1048576 or 64MiB,",
}


def describe_values(field: FieldInfo) -> str:
    """The valid values of a setting, in words."""
    if field.annotation is bool:
        return "true or false"
    if kind := _NUMBERS.get(PARSE_BYTES if PARSE_BYTES in field.metadata else field.annotation):
        minimum, maximum = _bound(field, "ge"), _bound(field, "le")
        # A field without a minimum is a time: it may be as short as you like, but not 0.
        begin = "above 0," if minimum is None else f"from {minimum}"
        return f"{kind} {begin} to {maximum}"
    if field.annotation is str:
        return "a text" if field.default == "" else "a text, not empty"
    words = re.findall(r"'(\w+)'", str(field.annotation))  # the texts of a Literal
    return f"one of {', '.join(words)}" if words else "a comma-separated list"


def _bound(field: FieldInfo, name: str) -> object:
    """The least ("ge") or greatest ("le") value of a setting; None if it has no such bound."""
    return next((getattr(part, name) for part in field.metadata if hasattr(part, name)), None)


def _settings_error(
    error: ValidationError, texts: Mapping[str, str], shown_names: Mapping[str, str]
) -> InvalidSettings:
    """The error with one line for each invalid setting; it does not repeat secrets.

    `texts` has the text of each setting, `shown_names` the variable or flag that the text is from.
    """
    lines = []
    for name in dict.fromkeys(str(details["loc"][0]) for details in error.errors()):
        field = Settings.model_fields[name]
        got = (
            "something else"
            if _is_secret(field)
            else repr(texts[name])
            if texts[name]
            else "nothing"
        )
        lines.append(f"{shown_names[name]}: got {got}, needed {describe_values(field)}.")
    return InvalidSettings("\n".join(lines))
