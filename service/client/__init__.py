"""A client for Python: arrays in and out, errors with places, retries, and long work as jobs.

To import it loads httpx and NumPy, and nothing of the service. `Local` has the same calls without
a server; only who names it loads the engine.
"""

from typing import TYPE_CHECKING

from service.client.answers import (
    ClosestPoints,
    Converted,
    Curve,
    Estimate,
    Intersections,
    Measures,
    MeshCheck,
    Points,
    Signed,
    Stored,
)
from service.client.call import Part
from service.client.clients import AsyncClient, Client
from service.client.errors import Issue, ServiceError
from service.client.mesh import Lines, Mesh, MeshPart
from service.client.picture import Picture
from service.client.records import Record
from service.client.surfaces import Surface, bezier, bspline

if TYPE_CHECKING:
    from service.client.local import Local

__all__ = [
    "AsyncClient",
    "Client",
    "ClosestPoints",
    "Converted",
    "Curve",
    "Estimate",
    "Intersections",
    "Issue",
    "Lines",
    "Local",
    "Measures",
    "Mesh",
    "MeshCheck",
    "MeshPart",
    "Part",
    "Picture",
    "Points",
    "Record",
    "ServiceError",
    "Signed",
    "Stored",
    "Surface",
    "bezier",
    "bspline",
]


def __getattr__(name: str) -> object:
    """`Local`, which is imported when it is named first: it loads the engine."""
    if name != "Local":
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from service.client import local  # noqa: PLC0415

    return local.Local
