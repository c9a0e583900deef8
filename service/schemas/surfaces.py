"""The JSON language of surfaces: the union of the models of all kinds.

To add a kind, write a module with its model (which has a `type` and a method `to_surface`) and with
a function that writes it as a document. Then add a line to `DEFINE` (and to `WITH_ROWS`, if the
kind has triangular nets), its name to `KINDS`, and a line to `_MemberSurface`.
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
"""For each kind, the function that writes a surface in the form of a request. A group and a
multipatch consist of other surfaces, so `definition` writes them."""

WITH_ROWS: Mapping[type[Surface], Callable[[dict[str, Any]], dict[str, Any]]] = MappingProxyType(
    {PatchSurface: patches.replace_rows, TriangleSurface: triangle.replace_rows}
)
"""For each kind with triangular nets, the function that splits these nets into rows, as documents
have them."""

KINDS = ("bezier", "bspline", "triangle", "patches", "multipatch", "tube", "ribbon", "group")
"""Names of the kinds of surface; the first is the default."""

_UNKNOWN = Issue("unknown_type", "No kind of surface has this name.")

_MemberSurface: TypeAlias = (
    Annotated[bezier.BezierDefinition, Tag("bezier")]
    | Annotated[bspline.BsplineDefinition, Tag("bspline")]
    | Annotated[patches.PatchesDefinition, Tag("patches")]
    | Annotated[triangle.TriangleDefinition, Tag("triangle")]
    | Annotated[multipatch.MultipatchDefinition, Tag("multipatch")]
    | Annotated[sweeps.TubeDefinition, Tag("tube")]
    | Annotated[sweeps.RibbonDefinition, Tag("ribbon")]
)
"""The kinds of surface that can be members of a group: all but a group."""

SurfaceDefinition = TypeAliasType(
    "SurfaceDefinition",
    Annotated[
        _MemberSurface | Annotated[group.GroupDefinition, Tag("group")],
        *one_of_kinds(
            KINDS, _UNKNOWN, "A surface: its `type` names the kind; the default is `bezier`."
        ),
    ],
)

MemberSurfaceDefinition = TypeAliasType(
    "MemberSurfaceDefinition",
    Annotated[
        _MemberSurface,
        # `KINDS` has `group` too: it is a known name, and `refuse_group` has an error of its own.
        *one_of_kinds(KINDS, _UNKNOWN, "A surface in a group: any but a group."),
        BeforeValidator(group.refuse_group),
    ],
)

group.MemberDefinition.model_rebuild(
    _types_namespace={"MemberSurfaceDefinition": MemberSurfaceDefinition}
)
group.GroupDefinition.model_rebuild()


def definition(surface: Surface, *, flat: bool = False) -> dict[str, Any]:
    """A surface in the form of a request, with NumPy arrays; omits fields that have no value.

    A triangular net is a list of rows, as in documents; if `flat`, it is one array.
    """
    kind = type(surface)
    if isinstance(surface, GroupSurface):
        return group.define_group(surface, partial(definition, flat=flat))
    if isinstance(surface, MultipatchSurface):
        return multipatch.define_multipatch(surface, partial(definition, flat=flat))
    content = DEFINE[kind](surface)
    return content if flat or kind not in WITH_ROWS else WITH_ROWS[kind](content)
