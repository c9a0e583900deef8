"""Opens the engine that the settings name, if it is not that of this machine."""

from importlib import import_module
from typing import TYPE_CHECKING

from service.errors import InvalidSettings
from service.settings.values import Settings

if TYPE_CHECKING:
    from service.jobs.dask_engine import DaskEngine


def open_cluster(settings: Settings) -> "DaskEngine":
    """The engine on the Dask cluster of the setting `dask`; it connects with the first batch.

    Raises
    ------
    InvalidSettings
        The address is invalid or lacks certificates, the extra `cluster` is not installed, or the
        workers cannot reach the store.
    """
    got = f"SURFACE_DASK: got {settings.dask!r}"
    try:
        module = import_module("service.jobs.dask_engine")
    except ModuleNotFoundError as error:
        needed = "the extra `cluster` to be installed"
        raise InvalidSettings(f"{got}, needed {needed}: {error.name} is missing.") from None
    if settings.store.startswith("memory:"):
        needed = "a store that the workers reach: set SURFACE_STORE to a folder or a bucket"
        raise InvalidSettings(f"{got}, needed {needed}.")
    engine: DaskEngine = module.open_dask(settings.dask, "SURFACE_DASK")
    return engine
