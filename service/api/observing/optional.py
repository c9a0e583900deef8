"""OpenTelemetry, where it is wanted and installed."""

from importlib import import_module
from typing import TYPE_CHECKING

from service.errors import InvalidSettings
from service.settings.values import Settings

if TYPE_CHECKING:
    from service.api.observing.tracing import Tracing


def tracing_of(settings: Settings) -> "Tracing | None":
    """What makes spans; None where none are wanted, and then nothing is imported for it.

    Raises
    ------
    InvalidSettings
        Where they are wanted, and what makes them is not installed.
    """
    if not settings.tracing:
        return None
    try:
        module = import_module("service.api.observing.tracing")
    except ModuleNotFoundError as error:
        raise InvalidSettings(
            "SURFACE_TRACING: got 'true', needed the extra `telemetry` to be installed: "
            f"there is no {error.name}."
        ) from None
    made: Tracing = module.exporting()
    return made
