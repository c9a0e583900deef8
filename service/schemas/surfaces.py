"""The kinds of surface as a document says them: one model a kind, one union of them all.

To add a kind: a module with its model (a `type` of its own and a `to_surface`) and its `define`;
here its line in `DEFINE`, its name in `KINDS` and its line in `SurfaceDefinition`.
"""

from collections.abc import Callable, Mapping
from functools import partial
from types import MappingProxyType
from typing import Annotated, Any, TypeAlias

from pydantic import BeforeValidator, Discriminator, Tag

from service.errors import Issue
from service.schemas import bezier, bspline, group, patches, sweeps, triangle
from service.schemas.unions import kind_of, of_known_kind
from service.surface import Surface
from service.surface.bezier import BezierSurface
from service.surface.bspline import BsplineSurface
from service.surface.group import GroupSurface
from service.surface.patches import PatchSurface
from service.surface.sweeps import RibbonSurface, TubeSurface
from service.surface.triangle import TriangleSurface

DEFINE: Mapping[type[Surface], Callable[..., dict[str, Any]]] = MappingProxyType(
    {
        BezierSurface: bezier.define,
        BsplineSurface: bspline.define,
        PatchSurface: patches.define,
        TriangleSurface: triangle.define,
        TubeSurface: sweeps.define_tube,
        RibbonSurface: sweeps.define_ribbon,
    }
)
"""What writes each kind of surface but groups back in the language of requests."""

KINDS = ("bezier", "bspline", "triangle", "patches", "tube", "ribbon", "group")
"""Names of the kinds of surface; the first is meant where none is said."""


_UNKNOWN = Issue("unknown_type", "There is no such kind of surface.")

SurfaceDefinition: TypeAlias = Annotated[
    Annotated[bezier.BezierDefinition, Tag("bezier")]
    | Annotated[bspline.BsplineDefinition, Tag("bspline")]
    | Annotated[patches.PatchesDefinition, Tag("patches")]
    | Annotated[triangle.TriangleDefinition, Tag("triangle")]
    | Annotated[sweeps.TubeDefinition, Tag("tube")]
    | Annotated[sweeps.RibbonDefinition, Tag("ribbon")]
    | Annotated[group.GroupDefinition, Tag("group")],
    Discriminator(kind_of(KINDS)),
    BeforeValidator(of_known_kind(KINDS, _UNKNOWN)),
]

# Its members are surfaces as well, of a union that exists only now.
group.MemberDefinition.model_rebuild(_types_namespace={"SurfaceDefinition": SurfaceDefinition})
group.GroupDefinition.model_rebuild()


def definition(surface: Surface, *, flat: bool = False) -> dict[str, Any]:
    """A surface in the language of requests, its arrays as they are; what it lacks left out.

    Nets over triangles come in rows, as documents write them, or `flat`, as one array each.
    """
    if isinstance(surface, GroupSurface):
        return group.define(surface, partial(definition, flat=flat))
    if isinstance(surface, TriangleSurface | PatchSurface):
        return DEFINE[type(surface)](surface, flat=flat)
    return DEFINE[type(surface)](surface)
