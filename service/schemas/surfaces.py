"""The kinds of surface as a document says them: one model a kind, one union of them all.

To add a kind: a module with its model (a `type` of its own and a `to_surface`) and its `define`;
here its line in `DEFINE`, its name in `KINDS` and its line in `SurfaceDefinition`.
"""

from collections.abc import Callable, Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Annotated, Any, TypeAlias

from pydantic import BeforeValidator, Discriminator, Tag

from service.errors import Issue
from service.schemas import bezier, bspline, group, patches, triangle
from service.schemas.refusals import refusal, wrong_type
from service.surface import Surface
from service.surface.bezier import BezierSurface
from service.surface.bspline import BsplineSurface
from service.surface.group import GroupSurface
from service.surface.patches import PatchSurface
from service.surface.triangle import TriangleSurface

DEFINE: Mapping[type[Surface], Callable[..., dict[str, Any]]] = MappingProxyType(
    {
        BezierSurface: bezier.define,
        BsplineSurface: bspline.define,
        PatchSurface: patches.define,
        TriangleSurface: triangle.define,
        GroupSurface: lambda surface: group.define(surface, definition),
    }
)
"""What writes each kind of surface back in the language of requests."""

KINDS = ("bezier", "bspline", "triangle", "patches", "group")
"""Names of the kinds of surface; the first is meant where none is said."""


def _kind_of(value: object) -> str | None:
    """The member of the union that a checked value wants to be."""
    return str(value.get("type", KINDS[0])) if isinstance(value, dict) else None


def _of_known_kind(value: object) -> object:
    """Refuses what names no kind, before the union is asked."""
    if not isinstance(value, dict):
        raise refusal([((), wrong_type(value, "an object"))])
    wanted = value.get("type", KINDS[0])
    needed = "one of " + ", ".join(KINDS)
    if not isinstance(wanted, str):
        raise refusal([((), replace(wrong_type(wanted, needed), pointer="/type"))])
    if wanted not in KINDS:
        got = "an unknown name"
        issue = Issue("unknown_type", "There is no such kind of surface.", "/type", got, needed)
        raise refusal([((), issue)])
    return value


SurfaceDefinition: TypeAlias = Annotated[
    Annotated[bezier.BezierDefinition, Tag("bezier")]
    | Annotated[bspline.BsplineDefinition, Tag("bspline")]
    | Annotated[patches.PatchesDefinition, Tag("patches")]
    | Annotated[triangle.TriangleDefinition, Tag("triangle")]
    | Annotated[group.GroupDefinition, Tag("group")],
    Discriminator(_kind_of),
    BeforeValidator(_of_known_kind),
]

# Its members are surfaces as well, of a union that exists only now.
group.MemberDefinition.model_rebuild(_types_namespace={"SurfaceDefinition": SurfaceDefinition})
group.GroupDefinition.model_rebuild()


def definition(surface: Surface) -> dict[str, Any]:
    """A surface in the language of requests, its arrays as they are; what it lacks left out."""
    return DEFINE[type(surface)](surface)
