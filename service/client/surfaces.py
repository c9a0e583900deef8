"""The ways to say which surface: a dictionary, an id, a file, or what another call has answered."""

import json
from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any, Literal, TypeAlias

import numpy as np

from service.client.answers import Converted, Stored
from service.client.fields import Numbers

Surface: TypeAlias = Mapping[str, Any] | str | Path | Converted | Stored
"""A dictionary of the interface, in which arrays may stand for lists; the id of a built-in or a
stored surface; a file; or an answer of `convert` or `store`."""

KnotName: TypeAlias = Literal["clamped", "uniform", "periodic"]
Knots: TypeAlias = KnotName | tuple[KnotName, KnotName] | tuple[Numbers, Numbers]

MEDIA_TYPES: Mapping[str, str] = MappingProxyType(
    {
        "npy": "application/x-npy",
        "bez": "model/x-oogl",
        "bbp": "model/x-oogl",
        "oogl": "model/x-oogl",
        "teapot": "text/x-teapot",
        "obj": "model/obj",
        "geomdl": "application/vnd.geomdl+json",
        "step": "model/step",
        "stp": "model/step",
        "p21": "model/step",
        "iges": "model/iges",
        "igs": "model/iges",
        "3dm": "model/vnd.3dm",
    }
)
"""The media types of files by suffix; `.json` is a surface, or a request with one."""

FILE_FIELDS = frozenset({"type", "degree", "knots", "homogeneous", "up", "name", "invalid_faces"})
"""Fields of a surface that stand beside a file that is not JSON."""


def bezier(net: Numbers, weights: Numbers | None = None, **fields: Any) -> dict[str, Any]:
    """A Bézier patch by its control net (p+1, q+1, 3), and weights (p+1, q+1) if it is rational.

    `fields` are further fields of the surface, such as `name`.
    """
    surface = {"type": "bezier", "control_net": np.asarray(net, np.float64), **fields}
    return surface if weights is None else surface | {"weights": np.asarray(weights, np.float64)}


def bspline(
    net: Numbers,
    degree: int | tuple[int, int] = 3,
    knots: Knots = "clamped",
    weights: Numbers | None = None,
    **fields: Any,
) -> dict[str, Any]:
    """A B-spline surface, or with weights a NURBS surface, by its control net (m, n, 3).

    Parameters
    ----------
    knots : str, or a pair of str or of arrays
        Names of knot vectors, or the vectors themselves: one for u and one for v.
    fields : dict
        Further fields of the surface, such as `name`.
    """
    surface = bezier(net, weights, **fields)
    knots = knots if isinstance(knots, str) else list(knots)  # type: ignore[assignment]
    return surface | {"type": "bspline", "degree": degree, "knots": knots}


def read_json(path: Path) -> dict[str, Any] | None:
    """The request in a JSON file, which may be a surface alone; None for surfaces of geomdl.

    Raises
    ------
    ValueError
        The file is not a JSON object.
    """
    document = json.loads(path.read_bytes())
    if not isinstance(document, dict):
        raise ValueError(f"{path}: got a list or a value, needed a surface as a JSON object")
    if "shape" in document:
        return None
    return document if "surface" in document else {"surface": document}


def find_media_type(path: Path) -> str:
    """The media type of a file, by its suffix.

    Raises
    ------
    ValueError
        The suffix is not known.
    """
    suffix = path.suffix.removeprefix(".").lower()
    if suffix == "json":
        return MEDIA_TYPES["geomdl"]
    if suffix not in MEDIA_TYPES:
        needed = ", ".join(f".{known}" for known in MEDIA_TYPES)
        raise ValueError(f"{path}: unknown suffix; needed .json, or one of {needed}")
    return MEDIA_TYPES[suffix]
