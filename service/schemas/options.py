"""How a surface shall be meshed and written: one model, behind the body and the query alike."""

from dataclasses import fields
from functools import lru_cache
from math import pi
from operator import attrgetter
from typing import Annotated, Any, Literal, TypeAlias

from pydantic import Field, model_validator

from service.engine.adaptive.tolerance_spec import Accuracy
from service.engine.options import (
    MAX_SIDES,
    MAX_WELD_TOLERANCE,
    MIN_SIDES,
    MeshOptions,
    Method,
    WireForm,
)
from service.schemas.accuracy import ACCURACY, MAX_COUNT, build_accuracy, refuse_conflict
from service.schemas.fields import (
    IsoCurves,
    Omittable,
    Overlays,
    Resolution,
    StrictModel,
    optional,
)
from service.surface.checks import MAX_COORDINATE

OoglForm: TypeAlias = Literal["cquad", "mesh", "off", "bez"]
Compression: TypeAlias = Literal["none", "meshopt"]
"""As `service.encoders.format` has them: languages and formats do not know each other."""

_DEFAULTS = MeshOptions()


class MeshOptionFields(StrictModel):
    """The options of a mesh. All may be left out."""

    resolution: Resolution = Field(
        # Not a default in the schema: clients that write out defaults would conflict with a
        # tolerance.
        default_factory=lambda: _DEFAULTS.resolution,
        description="Divisions of every patch: one number, or [u, v]; 16 if nothing is said. A "
        "patch has (u + 1) × (v + 1) vertices; a triangle takes the larger number n on all sides "
        "and has (n + 1)(n + 2)/2. Not beside a tolerance or a budget.",
        examples=[16, [16, 32]],
    )
    tolerance: Annotated[float | None, Omittable(), Field(gt=0, le=MAX_COORDINATE)] = optional(
        "How far the surface may be from the mesh, in model units. No point of it is further than "
        "this from the mesh as it is written, which is proved and not sampled: the report has the "
        "bound. It takes the place of a resolution. Patches are divided where the surface bends "
        "and in the direction in which it bends; shared edges by rules that depend on the edge "
        "alone. Below what the rounding of the written vertices allows it is refused "
        "(`tolerance_too_small`).",
        0.001,
    )
    relative_tolerance: Annotated[float | None, Omittable(), Field(gt=0, le=1)] = optional(
        "The tolerance as a share of the model's diagonal. The diagonal is that of the box about "
        "all control points; of a group, those of all members in their places. Not beside "
        "`tolerance`.",
        0.001,
    )
    angle_tolerance: Annotated[float | None, Omittable(), Field(gt=0, le=pi)] = optional(
        "How many radians apart the normals at the two ends of an edge may point. Sought and not "
        "proved: the report has the largest measured, `normal_angle`. Alone, or beside a "
        "tolerance.",
        0.2,
    )
    max_triangles: Annotated[int | None, Omittable(), Field(ge=1, le=MAX_COUNT)] = optional(
        "The most triangles: alone, the mesh with the least deviation that they allow. Fewer than "
        "the surface needs at all are refused (`budget_too_small`). Beside a tolerance "
        "it is a limit, and a mesh that needs more is refused (`too_many_triangles`).",
        2000,
    )
    max_bytes: Annotated[int | None, Omittable(), Field(ge=1, le=MAX_COUNT)] = optional(
        "The most bytes of the response in its format; alone and beside a tolerance as "
        "`max_triangles` is for triangles.",
        100_000,
    )
    two_sided: bool = Field(
        default=False,
        description="Whether the distance from the mesh to the surface is bounded, too. No point "
        "of the mesh is then further from the surface than twice the tolerance. The report has "
        "the bound, `mesh_deviation_bound`. Needs a tolerance or a budget.",
        examples=[True],
    )
    faces: Literal["triangles", "quads", "none"] = Field(
        default=_DEFAULTS.faces,
        description="Kind of faces: `triangles`, `quads` or `none`. `quads` only where the format "
        "has them; `none` leaves the surface out, so that its isoparametric curves or its "
        "overlays are all there is.",
        examples=["quads"],
    )
    normals: bool = Field(
        default=_DEFAULTS.normals, description="Whether vertices carry analytic unit normals."
    )
    uvs: bool = Field(
        default=_DEFAULTS.uvs,
        description="Whether vertices carry their parameters (u, v). They are those of the "
        "surface's own domain, the knots of a B-spline; of `patches`, those of each patch, from 0 "
        "to 1. A "
        "surface that has texture coordinates of its own (`uvs`) comes out with those, whatever is "
        "said here.",
    )
    curvatures: bool = Field(
        default=_DEFAULTS.curvatures,
        description="Whether vertices carry the surface's Gaussian and mean curvature. They are "
        "attributes, `gaussian_curvature` and `mean_curvature`, where the format has a place for "
        "attributes, and those of the surface itself, not of the mesh. Signs are those of `POST "
        "/v1/points`: mean curvature is positive where the surface bends towards its normal, so "
        "that a sphere of radius r whose normals point outwards has −1/r. In a group they are "
        "those of the surfaces as they are placed. Where a curvature is infinite or has no limit, "
        "as at the apex of a cone, it is 0, and so it is on wires. The report has the least and "
        "the greatest. Not for tubes and ribbons.",
        examples=[True],
    )
    weld: bool = Field(
        default=_DEFAULTS.weld,
        description="Whether patches share the vertices of the edges that they share. `false` "
        "keeps every sample of every patch as a vertex of its own, patch after patch, sample "
        "(i, j) → i (Rv + 1) + j with Rv the divisions along v; also the samples at a pole that "
        "no face uses.",
    )
    crease_angle: Annotated[float, Field(ge=0, le=pi)] = Field(
        default=_DEFAULTS.crease_angle,
        description="Angle in radians above which the normals of neighbouring patches stay apart.",
        examples=[0.5],
    )
    weld_tolerance: Annotated[float, Field(ge=0, le=MAX_WELD_TOLERANCE)] = Field(
        default=_DEFAULTS.weld_tolerance,
        description="The share of the model's diagonal within which control points on borders of "
        "patches count as one. So sides that are equal up to rounding are one edge, surfaces "
        "close, and sides are poles. Points that are near, or have near points between them, are "
        "a group; a group wider than the tolerance is left as it is. An edge has the positions of "
        "the side whose control points come first in dictionary order, whatever the order of the "
        "patches. Far from zero, where coordinates are too coarse for that, 2^-50 of the largest "
        "one counts as near. How far anything moved is `moved` in the report and part of every "
        "bound. Surfaces are cut where borders are one curve in other knots. 0: only what is equal "
        "bit for bit.",
        examples=[1e-9],
    )
    overlays: Overlays = Field(
        default=_DEFAULTS.overlays,
        description="Lines to draw beside the faces, where the format has lines.",
        examples=[["control_net", "boundary"]],
    )
    isocurves: IsoCurves = Field(
        default=_DEFAULTS.isocurves,
        description="Isoparametric curves: one number n, or [n_u, n_v]. Every patch (of a "
        "B-spline, every knot span) shows its curves u = i/n_u and v = j/n_v, borders included, a "
        "shared one once; of a triangle r, s and t = i/n. 0 draws none in that direction.",
        examples=[4, [1, 2]],
    )
    wires: WireForm = Field(
        default=_DEFAULTS.wires,
        description="What isoparametric curves are drawn as: `lines`, `tubes` or `ribbons`. Lines "
        "only where the format has them; ribbons lie flat on the surface, a twentieth of their "
        "width above its faces.",
        examples=["tubes"],
    )
    wire_width: Annotated[float | None, Omittable(), Field(gt=0, le=MAX_COORDINATE)] = optional(
        "Diameter of the tubes or width of the ribbons, in model units. A 300th of the diagonal of "
        "the control points if left out.",
        0.02,
    )
    wire_sides: Annotated[int, Field(ge=MIN_SIDES, le=MAX_SIDES)] = Field(
        default=_DEFAULTS.wire_sides, description="Sides of a tube.", examples=[12]
    )
    method: Method = Field(
        default=_DEFAULTS.method,
        description="How samples are computed: by one of three algorithms. `matrix`: products "
        "with Bernstein bases. `de_casteljau`: repeated interpolation of control points, the "
        "stablest and by far the slowest. `forward_difference`: additions along rows, for degrees "
        "up to 8 (16 where the format stores float64), with an error that grows with the "
        "resolution. They agree to the accuracy that each can have; `docs/methods.md` has figures.",
        examples=["de_casteljau"],
    )
    oogl: Annotated[OoglForm | None, Omittable()] = optional(
        "Form of an OOGL file: `cquad`, `mesh`, `off` or `bez`. `cquad` is the default for grids "
        "of quads, `off` elsewhere; `bez` holds the exact patches (a triangle as a square with one "
        "side in a point). Other formats do not read it.",
        "bez",
    )
    quantize: bool = Field(
        default=False,
        description="Whether glTF is written in whole numbers of 16 bits "
        "(`KHR_mesh_quantization`). Positions are multiples of a step, a power of two, at most a "
        "32 766th of the longest side of the box about the control points; normals within 0.002°; "
        "texture coordinates from 0 to 1, and colours, in 16 bits. Every vertex moves by 0.87 "
        "steps at most, which the certified deviation counts, and a tolerance holds for the "
        "written file. All parts of a surface have one grid, and so have members of a group that "
        "meet in the same place: seams stay closed. Other formats refuse it "
        "(`unsupported_by_format`).",
        examples=[True],
    )
    compression: Compression = Field(
        default="none",
        description="How the arrays of a glTF are compressed: `none` or `meshopt`. "
        "With `meshopt` (`EXT_meshopt_compression`) vertices and triangles come in another order. "
        "No number changes; beside `quantize` the "
        "normals do, by 0.1° at most. Readers need a decoder (three.js and Babylon.js have one). "
        "Other formats refuse it, and so does a service without the library "
        "(`compression_unavailable`; `GET /v1/formats` tells).",
        examples=["meshopt"],
    )

    @model_validator(mode="after")
    def _divided_by_one_rule(self) -> "MeshOptionFields":
        if not self.model_fields_set.isdisjoint(ACCURACY):
            refuse_conflict(self)
        return self

    def mesh_options(self) -> MeshOptions:
        """The part that the engine reads.

        Raises
        ------
        InvalidRequest
            Where options that are right by themselves do not go together; pointers `/name`.
        """
        is_stated = not self.model_fields_set.isdisjoint(ACCURACY)
        return _mesh_options(_of_engine(self), build_accuracy(self) if is_stated else None)


_OF_ENGINE = [
    field.name for field in fields(MeshOptions) if field.name in MeshOptionFields.model_fields
]
"""Options that the engine reads as they are."""

_of_engine = attrgetter(*_OF_ENGINE)


@lru_cache(256)
def _mesh_options(of_engine: tuple[object, ...], accuracy: Accuracy | None) -> MeshOptions:
    """The options of the engine, made and checked once: clients repeat them."""
    values: dict[str, Any] = dict(zip(_OF_ENGINE, of_engine, strict=True))
    if values["faces"] == "none":
        values |= {"faces": "triangles", "has_faces": False}
    return MeshOptions(**values, accuracy=accuracy)
