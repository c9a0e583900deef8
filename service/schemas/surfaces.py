"""The JSON language of surfaces: a model for each kind, and the union of all.

To add a kind: a module with its model (a `type` of its own and a `to_surface`) and a function
that writes it; here its line in `DEFINE` (and in `WITH_ROWS`, if it has nets over triangles), its
name in `KINDS` and its line in `_Single`.
"""

from collections.abc import Callable, Mapping
from functools import partial
from types import MappingProxyType
from typing import Annotated, Any, TypeAlias

from pydantic import BeforeValidator, Tag
from typing_extensions import TypeAliasType

from service.errors import Issue
from service.schemas import bezier, bspline, group, multipatch, patches, sweeps, triangle
from service.schemas.fields import one_of_kinds
from service.surface import Surface
from service.surface.bezier import BezierSurface
from service.surface.bspline import BsplineSurface
from service.surface.group import GroupSurface
from service.surface.multipatch import MultipatchSurface
from service.surface.patches import PatchSurface
from service.surface.sweeps import RibbonSurface, TubeSurface
from service.surface.triangle import TriangleSurface

DEFINE: Mapping[type[Surface], Callable[..., dict[str, Any]]] = MappingProxyType(
    {
        BezierSurface: bezier.define_bezier,
        BsplineSurface: bspline.define_bspline,
        PatchSurface: patches.define_patches,
        TriangleSurface: triangle.define_triangle,
        TubeSurface: sweeps.define_tube,
        RibbonSurface: sweeps.define_ribbon,
    }
)
"""Functions that write a surface in the form of a request, by kind, for kinds without members."""

WITH_ROWS: Mapping[type[Surface], Callable[[dict[str, Any]], dict[str, Any]]] = MappingProxyType(
    {PatchSurface: patches.replace_rows, TriangleSurface: triangle.replace_rows}
)
"""Functions that turn arrays over triangles into the rows that documents have, by kind."""

KINDS = ("bezier", "bspline", "triangle", "patches", "multipatch", "tube", "ribbon", "group")
"""Names of the kinds of surface; the first is the default."""

_UNKNOWN = Issue("unknown_type", "No kind of surface has this name.")

_Single: TypeAlias = (
    Annotated[bezier.BezierDefinition, Tag("bezier")]
    | Annotated[bspline.BsplineDefinition, Tag("bspline")]
    | Annotated[patches.PatchesDefinition, Tag("patches")]
    | Annotated[triangle.TriangleDefinition, Tag("triangle")]
    | Annotated[multipatch.MultipatchDefinition, Tag("multipatch")]
    | Annotated[sweeps.TubeDefinition, Tag("tube")]
    | Annotated[sweeps.RibbonDefinition, Tag("ribbon")]
)

SurfaceDefinition = TypeAliasType(
    "SurfaceDefinition",
    Annotated[
        _Single | Annotated[group.GroupDefinition, Tag("group")],
        *one_of_kinds(
            KINDS, _UNKNOWN, "A surface: its `type` names the kind; the default is `bezier`."
        ),
    ],
)

MemberSurfaceDefinition = TypeAliasType(
    "MemberSurfaceDefinition",
    Annotated[
        _Single,
        *one_of_kinds(KINDS, _UNKNOWN, "A surface in a group: any but a group."),
        BeforeValidator(group.refuse_group),
    ],
)

group.MemberDefinition.model_rebuild(
    _types_namespace={"MemberSurfaceDefinition": MemberSurfaceDefinition}
)
group.GroupDefinition.model_rebuild()


def definition(surface: Surface, *, flat: bool = False) -> dict[str, Any]:
    """A surface in the form of a request, with NumPy arrays, without the fields that it lacks.

    Nets over triangles come in rows, as documents write them, or `flat`, as one array each.
    """
    kind = type(surface)
    if isinstance(surface, GroupSurface):
        return group.define_group(surface, partial(definition, flat=flat))
    if isinstance(surface, MultipatchSurface):
        return multipatch.define_multipatch(surface, partial(definition, flat=flat))
    content = DEFINE[kind](surface)
    return content if flat or kind not in WITH_ROWS else WITH_ROWS[kind](content)
