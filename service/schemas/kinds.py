"""The kinds of surface that requests can name: their fields, and the models of all but groups.

To add a kind, write a module with its model, which has a `type` and a method `to_surface`. Then add
the fields of the kind to `FIELDS`, and a line to `MemberKind`.
"""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Annotated, TypeAlias

from pydantic import Tag

from service.errors import Issue
from service.schemas import bezier, brep, bspline, patches, sweeps
from service.surface.bezier import BezierSurface, TriangleSurface
from service.surface.brep import BrepSurface
from service.surface.bspline import BsplineSurface
from service.surface.group import GroupSurface
from service.surface.multipatch import MultipatchSurface
from service.surface.patches import PatchSurface
from service.surface.sizes import SurfaceKind
from service.surface.sweeps import RibbonSurface, TubeSurface

CHANNELS = ("colors", "uvs", "attributes")
"""Names of the fields that are attributes of `channels` of a surface."""

FIELDS: Mapping[type[SurfaceKind], tuple[str, ...]] = MappingProxyType(
    {
        BezierSurface: ("bezier", "control_net", "weights", *CHANNELS),
        BsplineSurface: ("bspline", "control_net", "degree", "knots", "weights", *CHANNELS),
        TriangleSurface: ("triangle", "control_net", "weights", *CHANNELS),
        PatchSurface: (
            "patches",
            "vertices",
            "patches",
            "triangles",
            "parts",
            "weights",
            *CHANNELS,
        ),
        MultipatchSurface: ("multipatch", "surfaces"),
        TubeSurface: ("tube", "curve", "radius", "sides", "caps"),
        RibbonSurface: ("ribbon", "curve", "width", "facing", "camera"),
        BrepSurface: (
            "brep",
            "vertices",
            "vertex_uncertainties",
            "edges",
            "faces",
            "shells",
            "uncertainty",
            "invalid_faces",
            "metres_per_unit",
        ),
        GroupSurface: ("group", "definitions", "members", "metres_per_unit"),
    }
)
"""For each kind, its name in requests, and its fields in the order in which a document has them;
after them it has `up` and `name`."""

KINDS = tuple(name for name, *_ in FIELDS.values())
"""Names of the kinds; the first is the default."""

UNKNOWN_KIND = Issue("unknown_type", "No kind of surface has this name.")

MemberKind: TypeAlias = (
    Annotated[bezier.BezierDefinition, Tag("bezier")]
    | Annotated[bspline.BsplineDefinition, Tag("bspline")]
    | Annotated[patches.PatchesDefinition, Tag("patches")]
    | Annotated[bezier.TriangleDefinition, Tag("triangle")]
    | Annotated[patches.MultipatchDefinition, Tag("multipatch")]
    | Annotated[sweeps.TubeDefinition, Tag("tube")]
    | Annotated[sweeps.RibbonDefinition, Tag("ribbon")]
    | Annotated[brep.BrepDefinition, Tag("brep")]
)
"""The kinds of surface that can be members of a group: all but a group."""
