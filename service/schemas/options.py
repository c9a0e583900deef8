"""The options of a mesh and of its file: the model is the same for bodies and for queries."""

from dataclasses import fields
from functools import lru_cache
from math import pi
from operator import attrgetter
from typing import Annotated, Any, Literal, TypeAlias

from pydantic import Field, model_validator

from service.engine.accuracy import Accuracy
from service.engine.options import (
    MAX_SIDES,
    MAX_WELD_TOLERANCE,
    MIN_SIDES,
    MeshOptions,
    Method,
    WireForm,
)
from service.schemas.accuracy import ACCURACY_FIELDS, MAX_COUNT, build_accuracy, refuse_conflict
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
StlForm: TypeAlias = Literal["binary", "ascii"]
Compression: TypeAlias = Literal["none", "meshopt"]
"""Equal to the types in `service.encoders.format`, which this layer must not import."""

_DEFAULTS = MeshOptions()


class MeshOptionFields(StrictModel):
    """The options of a mesh. All of them have defaults."""

    resolution: Resolution = Field(
        # A factory, so that the JSON Schema shows no default: some clients send all defaults, and
        # a resolution together with a tolerance is refused.
        default_factory=lambda: _DEFAULTS.resolution,
        description="Divisions of every patch: one number, or [u, v]; by default 16. A patch has "
        "(u + 1) × (v + 1) vertices. A triangle uses the larger number n for all sides and has "
        "(n + 1)(n + 2)/2 vertices. Not together with a tolerance, `max_triangles` or `max_bytes`, "
        "and not for breps.",
        examples=[16, [16, 32]],
    )
    tolerance: Annotated[float | None, Omittable(), Field(gt=0, le=MAX_COORDINATE)] = optional(
        "The largest distance of the surface from the mesh, in model units. No point of the "
        "surface is further than this from the mesh in the file. This is proved, not sampled, and "
        "the report has the proved bound. Use a tolerance in place of a resolution. Patches are "
        "divided where the surface bends, and in the direction in which it bends; the division "
        "of a shared edge depends on the edge alone. A tolerance below the rounding of the "
        "written vertices is refused (`tolerance_too_small`).",
        0.001,
    )
    relative_tolerance: Annotated[float | None, Omittable(), Field(gt=0, le=1)] = optional(
        "The tolerance as a share of the model's diagonal, which is the diagonal of the bounding "
        "box of all control points (for a group, of all members after placement). Not together "
        "with `tolerance`. Breps, and groups with breps, are meshed with 0.001 if the request has "
        "no option of accuracy. The box of a brep does not contain the parts of surfaces outside "
        "of its faces, and no mesh of a brep is coarser than 0.02.",
        0.001,
    )
    angle_tolerance: Annotated[float | None, Omittable(), Field(gt=0, le=pi)] = optional(
        "The largest angle in radians between the normals at the two ends of an edge. This angle "
        "is an aim and is not proved; the report has the largest measured angle, `normal_angle`. "
        "Use it alone, or together with a tolerance.",
        0.2,
    )
    max_triangles: Annotated[int | None, Omittable(), Field(ge=1, le=MAX_COUNT)] = optional(
        "The most triangles of the mesh. Without a tolerance, the service makes the deviation as "
        "small as it can with this number of triangles; a number below that of the coarsest mesh "
        "is refused (`budget_too_small`). Together with a tolerance, this number is a limit: if "
        "the mesh needs more triangles, the request is refused (`too_many_triangles`).",
        2000,
    )
    max_bytes: Annotated[int | None, Omittable(), Field(ge=1, le=MAX_COUNT)] = optional(
        "The most bytes of the response in its format. With and without a tolerance, this option "
        "limits bytes as `max_triangles` limits triangles.",
        100_000,
    )
    two_sided: bool = Field(
        default=False,
        description="Whether to bound the distance from the mesh to the surface too. No point of "
        "the mesh is then further from the surface than twice the tolerance. The report has the "
        "bound, `mesh_deviation_bound`. Needs a tolerance (`angle_tolerance` is not enough), "
        "`max_triangles` or `max_bytes`.",
        examples=[True],
    )
    faces: Literal["triangles", "quads", "none"] = Field(
        default=_DEFAULTS.faces,
        description="Kind of faces: `triangles`, `quads` or `none`. `quads` is allowed only if the "
        "format has quads. With `none` the file has only isoparametric curves and overlays.",
        examples=["quads"],
    )
    normals: bool = Field(
        default=_DEFAULTS.normals, description="Whether vertices carry analytic unit normals."
    )
    uvs: bool = Field(
        default=_DEFAULTS.uvs,
        description="Whether vertices carry their parameters (u, v). For a B-spline they are in "
        "the domain of its knots; for `patches`, in each patch from 0 to 1. If the surface has "
        "texture coordinates (`uvs`), vertices always carry these in place of the parameters.",
    )
    curvatures: bool = Field(
        default=_DEFAULTS.curvatures,
        description="Whether vertices carry the Gaussian and mean curvature of the exact "
        "surface. Formats with attributes write them as `gaussian_curvature` and "
        "`mean_curvature`. Signs are those of `POST /v1/points`: mean curvature is positive "
        "where the surface bends towards its normal, so a sphere of radius r with outward "
        "normals has −1/r. In a group they are the curvatures of the surfaces after placement. A "
        "curvature that is infinite or has no limit, for example at the apex of a cone, is written "
        "as 0; the curvatures of wires are written as 0, too. The report has the least and the "
        "greatest curvature. Not for tubes and ribbons.",
        examples=[True],
    )
    weld: bool = Field(
        default=_DEFAULTS.weld,
        description="Whether patches share the vertices of common edges. With `false` every "
        "sample of every patch is a vertex of its own, even samples at a pole that no face uses. "
        "Vertices are then ordered patch by patch; sample (i, j) of a patch is its vertex number "
        "i (Rv + 1) + j, where Rv is the number of divisions along v. Not for breps.",
    )
    crease_angle: Annotated[float, Field(ge=0, le=pi)] = Field(
        default=_DEFAULTS.crease_angle,
        description="Angle in radians. If the normals of neighbouring patches differ by more, the "
        "common edge is a crease: each patch keeps its own normals there. So do faces of breps.",
        examples=[0.5],
    )
    weld_tolerance: Annotated[float, Field(ge=0, le=MAX_WELD_TOLERANCE)] = Field(
        default=_DEFAULTS.weld_tolerance,
        description="A share of the model's diagonal. Control points on borders of patches that "
        "are nearer to each other than this count as one point. So sides that are equal up to "
        "rounding become one edge, closed surfaces have no gaps, and collapsed sides become poles. "
        "Near points, and points connected by a chain of near points, form a cluster; in a cluster "
        "wider than the tolerance, only points nearer than 1/8 of the tolerance become one. "
        "Patches without width are left out of the mesh. When two sides become one edge, the edge "
        "gets the positions of the side whose control points come first in lexicographic order, "
        "whatever the order of the patches. Far from the origin, where coordinates are too coarse "
        "for this tolerance, points nearer to each other than 2^-50 times the largest coordinate "
        "count as near. The report has the largest move of a point as `moved`, and every bound "
        "includes it. If two borders are the same curve with different knots, the surfaces are "
        "split at these knots. With 0, only points that are equal bit for bit are joined.",
        examples=[1e-9],
    )
    orient: bool = Field(
        default=_DEFAULTS.orient,
        description="Whether to turn patches so that neighbours agree about the side to which "
        "their normals point, and closed surfaces have a positive volume. A turned patch has u and "
        "v exchanged. Of an open surface the side stays on which most patches are. A surface "
        "without a consistent orientation, such as a Möbius strip, is not turned. The report lists "
        "the patches (`turned`, `not_orientable`). Breps, tubes and ribbons stay as they are.",
        examples=[True],
    )
    overlays: Overlays = Field(
        default=_DEFAULTS.overlays,
        description="Lines to draw in addition to the faces, if the format has lines. For breps "
        "`boundary` has all edges, drawn through vertices of the mesh; they have no `control_net`.",
        examples=[["control_net", "boundary"]],
    )
    isocurves: IsoCurves = Field(
        default=_DEFAULTS.isocurves,
        description="Isoparametric curves: one number n, or [n_u, n_v]. Every patch (of a "
        "B-spline, every knot span) gets the curves u = i/n_u and v = j/n_v, with its borders; a "
        "shared border is drawn once. A triangle gets the curves r = i/n, s = i/n and t = i/n. 0 "
        "draws no curves in that direction. Not for breps.",
        examples=[4, [1, 2]],
    )
    wires: WireForm = Field(
        default=_DEFAULTS.wires,
        description="The form of isoparametric curves: `lines`, `tubes` or `ribbons`. `lines` is "
        "allowed only if the format has lines. Ribbons lie flat on the surface, 1/20 of their "
        "width above its faces.",
        examples=["tubes"],
    )
    wire_width: Annotated[float | None, Omittable(), Field(gt=0, le=MAX_COORDINATE)] = optional(
        "Diameter of the tubes or width of the ribbons, in model units. By default 1/300 of the "
        "diagonal of the bounding box of the control points.",
        0.02,
    )
    wire_sides: Annotated[int, Field(ge=MIN_SIDES, le=MAX_SIDES)] = Field(
        default=_DEFAULTS.wire_sides, description="Sides of a tube.", examples=[12]
    )
    method: Method = Field(
        default=_DEFAULTS.method,
        description="The algorithm that computes samples: `matrix`, `de_casteljau` or "
        "`forward_difference`. `matrix`: products with Bernstein bases. `de_casteljau`: repeated "
        "interpolation of control points, the most stable and by far the slowest. "
        "`forward_difference`: additions along rows, for degrees up to 8 (16 if the format "
        "stores float64), with an error that grows with the resolution. `docs/methods.md` compares "
        "the accuracy of these algorithms.",
        examples=["de_casteljau"],
    )
    oogl: Annotated[OoglForm | None, Omittable()] = optional(
        "Form of an OOGL file: `cquad`, `mesh`, `off` or `bez`. The default is `cquad` for grids "
        "of quads, else `off`. `bez` stores the exact patches; a triangle is stored as a "
        "four-sided patch with one side collapsed to a point. Other formats ignore this option.",
        "bez",
    )
    quantize: bool = Field(
        default=False,
        description="Whether glTF is written in 16-bit integers "
        "(`KHR_mesh_quantization`). Positions are multiples of a step, a power of two, at most "
        "1/32,766 of the longest side of the bounding box of the control points. Normals are "
        "exact within 0.002°. Colours, and texture coordinates from 0 to 1, have 16 bits. Every "
        "vertex moves by at most 0.87 steps; the proved deviation includes this move, and a "
        "tolerance holds for the written file. All parts of a surface use the same step and "
        "origin, and members of a group that meet use the same, too, so that seams have no gaps. "
        "Other formats refuse this option (`unsupported_by_format`).",
        examples=[True],
    )
    compression: Compression = Field(
        default="none",
        description="Compression of the arrays of glTF: `none` or `meshopt`. With `meshopt` "
        "(`EXT_meshopt_compression`) vertices and triangles have another order. No number "
        "changes; but together with `quantize`, normals change by at most 0.1°. Readers need a "
        "decoder (three.js and Babylon.js have one). Other formats refuse `meshopt`. A service "
        "without the library refuses it, too (`compression_unavailable`); `GET /v1/formats` lists "
        "the compressions of the service.",
        examples=["meshopt"],
    )
    stl: StlForm = Field(
        default="binary",
        description="Form of an STL file: `binary`, or `ascii`, a text with the same numbers and "
        "some four times the length. Other formats ignore this option.",
        examples=["ascii"],
    )

    @model_validator(mode="after")
    def _check_conflicts(self) -> "MeshOptionFields":
        if not self.model_fields_set.isdisjoint(ACCURACY_FIELDS):
            refuse_conflict(self)
        return self

    def mesh_options(self) -> MeshOptions:
        """The options for the engine.

        Raises
        ------
        InvalidRequest
            Two options conflict, although each is valid; the pointer is `/` and a name.
        """
        has_accuracy = not self.model_fields_set.isdisjoint(ACCURACY_FIELDS)
        return _mesh_options(
            _get_engine_values(self),
            build_accuracy(self) if has_accuracy else None,
            has_resolution="resolution" in self.model_fields_set,
        )


_ENGINE_NAMES = [
    field.name for field in fields(MeshOptions) if field.name in MeshOptionFields.model_fields
]
"""Names of the options that `MeshOptions` has too."""

_get_engine_values = attrgetter(*_ENGINE_NAMES)


@lru_cache(256)
def _mesh_options(
    engine_values: tuple[object, ...], accuracy: Accuracy | None, *, has_resolution: bool
) -> MeshOptions:
    """The options for the engine, from the values of the options `_ENGINE_NAMES`.

    The result is cached, because clients often repeat the same options.
    """
    values: dict[str, Any] = dict(zip(_ENGINE_NAMES, engine_values, strict=True))
    if values["faces"] == "none":
        # For the engine, the kind of faces is one option, and whether there are faces is another.
        values |= {"faces": "triangles", "has_faces": False}
    return MeshOptions(**values, accuracy=accuracy, has_resolution=has_resolution)
