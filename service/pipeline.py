"""Surface and options in, bytes out: the product as a list of steps.

HTTP, the command line and whatever else comes call these functions and nothing below them.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from service.encoders import json_points
from service.encoders.format import EncodeOptions, Format, MeshSize
from service.encoders.prediction import predict
from service.encoders.text import json_bound, json_text
from service.engine import de_casteljau, forward_difference, sweeping
from service.engine.build import (
    NOT_PATCHES,
    as_patches,
    build,
    build_scene,
    carrying,
    highest_degree,
    lines_of,
    reach,
)
from service.engine.mesh import Mesh
from service.engine.options import MeshOptions
from service.engine.places import Places, Query, locate
from service.engine.points import effort, points
from service.errors import InvalidRequest, Issue, TooLarge, UnsupportedByFormat
from service.schemas.surfaces import definition
from service.surface import Surface
from service.surface.checks import MAX_COORDINATE
from service.surface.convert import convert
from service.surface.convert.nets import Allowed
from service.surface.convert.operations import Operation
from service.surface.group import GroupSurface
from service.surface.lowered import GroupModel, Model, PatchModel
from service.surface.sweep_model import SweepModel
from service.surface.sweeps import RibbonSurface, TubeSurface

NOT_PARAMETRIC = Issue(
    "not_parametric",
    "Parameters mean nothing on a group; each of its surfaces has its own.",
    "/surface",
    "a group",
    "one of its members",
)


class Lowerable(Protocol):
    """Whatever lowers to a model that can be meshed."""

    def lower(self) -> Model:
        """The surface as batches of Bézier patches, or as a group of such."""
        ...


@dataclass(frozen=True, slots=True)
class Limits:
    """The largest result that is computed: vertices, bytes of one answer, points of a query.

    `max_multiplications` is the most that the method `de_casteljau`, a query, or what is swept
    along curves may take: seconds.
    """

    max_vertices: int = 4_500_000
    max_bytes: int = 256 << 20
    max_points: int = 250_000
    max_multiplications: int = 5_000_000_000


PLAIN = EncodeOptions()
DEFAULT_LIMITS = Limits()


@dataclass(frozen=True, eq=False, slots=True)
class Work:
    """A file that may be computed: everything is known of it but its bytes."""

    model: Model
    options: MeshOptions
    fmt: Format
    encode: EncodeOptions
    size: MeshSize

    def run(self) -> bytes:
        """The file."""
        if self.encode.exact and self.fmt.encode_exact is not None:
            patches = as_patches(self.model)
            return self.fmt.encode_exact(patches, lines_of(patches, self.options))
        if isinstance(self.model, GroupModel) and self.fmt.encode_scene is not None:
            scene = build_scene(self.model, self.options, single=self.fmt.single)
            return self.fmt.encode_scene(scene, self.encode)
        return self.fmt.encode(mesh(self.model, self.options, self.fmt), self.encode)


def plan(
    surface: Lowerable,
    options: MeshOptions,
    fmt: Format,
    encode: EncodeOptions = PLAIN,
    limits: Limits = DEFAULT_LIMITS,
) -> Work:
    """What is to be computed, after it was found possible and affordable.

    Raises
    ------
    TooLarge, UnsupportedByFormat
        From the shapes alone: nothing large has been allocated.
    """
    model, options = carried(surface.lower(), options, fmt)
    if encode.exact and fmt.encode_exact is not None:
        as_patches(model)  # refuses what is none
    size = predict(model, options)
    shared = fmt.encode_scene is not None and not encode.exact
    stored = predict(model, options, shared=True) if shared else size
    _check_wires(model, options)
    _check_format(options, fmt, encode)
    _check_vertices(size, limits)
    _check_sweeps(model, options, limits)
    _check_method(model, options, fmt, limits)
    _check_bytes(stored, fmt, encode, limits)
    return Work(model, options, fmt, encode, size)


def render(
    surface: Lowerable,
    options: MeshOptions,
    fmt: Format,
    encode: EncodeOptions = PLAIN,
    limits: Limits = DEFAULT_LIMITS,
) -> bytes:
    """The surface as a file of this format; raises what `plan` raises."""
    return plan(surface, options, fmt, encode, limits).run()


@dataclass(frozen=True, eq=False, slots=True)
class PointsWork:
    """A query that may be answered: everything is known of it but the numbers."""

    model: PatchModel
    places: Places
    order: int

    def run(self) -> bytes:
        """The answer as JSON."""
        return json_points.encode(points(self.model, self.places, self.order))


def plan_points(surface: Lowerable, query: Query, limits: Limits = DEFAULT_LIMITS) -> PointsWork:
    """What is to be computed at places of a surface.

    Raises
    ------
    InvalidRequest
        Where a place lies outside the surface, or on no patch; `not_parametric`.
    TooLarge
        From the number of places, and the degrees of the patches on which they lie.
    """
    _check_points(query, limits)
    model = parametric(surface.lower())
    places = locate(model, query)
    count = effort(model, places, query.order)
    if count > limits.max_multiplications:
        raise TooLarge(
            Issue(
                "too_costly",
                "Patches of so high a degree take long where they are degenerate.",
                f"/{query.field}",
                f"up to {count} multiplications",
                f"at most {limits.max_multiplications}; fewer points on fewer patches at once",
            )
        )
    return PointsWork(model, places, query.order)


def converted(
    surface: Surface,
    operations: Sequence[Operation],
    allowed: Allowed,
    limits: Limits = DEFAULT_LIMITS,
) -> bytes:
    """The surface after the operations, as a JSON document that other requests can begin with.

    Raises
    ------
    InvalidRequest, TooLarge
        With pointers into the request for it, `/operations/…`.
    """
    if isinstance(surface, GroupSurface):
        raise InvalidRequest(NOT_PARAMETRIC)
    if isinstance(surface, TubeSurface | RibbonSurface):
        raise InvalidRequest(NOT_PATCHES)
    document = {"surface": definition(convert(surface, operations, allowed))}
    most = json_bound(document)
    if most > limits.max_bytes:
        raise TooLarge(
            Issue(
                "too_many_bytes",
                "The surface could become too large as JSON.",
                "/operations",
                f"up to {most} bytes",
                f"at most {limits.max_bytes}",
            )
        )
    return json_text(document)


def parametric(model: Model) -> PatchModel:
    """A model that has points at parameters, and patches that can be converted.

    Raises
    ------
    InvalidRequest
        `not_parametric`, pointing into the request.
    """
    if isinstance(model, GroupModel):
        raise InvalidRequest(NOT_PARAMETRIC)
    return as_patches(model)


def mesh(model: Model, options: MeshOptions, fmt: Format) -> Mesh:
    """The mesh of a model in the precision that the format stores."""
    return build(model, options, single=fmt.single)


def carried(model: Model, options: MeshOptions, fmt: Format) -> tuple[Model, MeshOptions]:
    """The model and the options without what the format has no place for beside positions.

    A surface keeps its colours and attributes whatever becomes of it, so they are left out and not
    refused; and nothing is computed, or kept apart, for their sake.
    """
    uvs = options.uvs and "uvs" in fmt.carries
    model = carrying(model, fmt.carries, apart=fmt.encode_scene is not None)
    return model, replace(options, uvs=uvs)


def _check_wires(model: Model, options: MeshOptions) -> None:
    """Refuses isoparametric curves of what has no parameters, and wires that are too wide."""
    models = model.models if isinstance(model, GroupModel) else (model,)
    if options.solid_wires and (furthest := reach(model, options)) > MAX_COORDINATE:
        raise InvalidRequest(
            Issue(
                "coordinate_too_large",
                "Coordinates are stored in single precision.",
                "/wire_width",
                f"wires that reach as far as {furthest:.6g}",
                f"at most {MAX_COORDINATE:.7g}",
            )
        )
    if all(isinstance(own, PatchModel) for own in models) or not (
        options.wired or not options.surface
    ):
        return
    raise InvalidRequest(
        Issue(
            "not_parametric",
            "Tubes and ribbons have no isoparametric curves; they are made of their faces.",
            "/isocurves" if options.wired else "/faces",
            "a tube or a ribbon",
            "no isoparametric curves, and faces",
        )
    )


def _check_format(options: MeshOptions, fmt: Format, encode: EncodeOptions) -> None:
    """Refuses what the format cannot hold."""
    if options.faces == "quads" and not fmt.quads:
        raise UnsupportedByFormat(
            Issue(
                "unsupported_by_format",
                f"The format {fmt.name} has only triangles.",
                "/faces",
                "quads",
                "triangles, or another format",
            )
        )
    if options.overlays and not fmt.overlays:
        raise UnsupportedByFormat(
            Issue(
                "unsupported_by_format",
                f"The format {fmt.name} has no place for lines.",
                "/overlays",
                "overlays",
                "none, or another format",
            )
        )
    if options.wired and not options.solid_wires and not fmt.overlays:
        raise UnsupportedByFormat(
            Issue(
                "unsupported_by_format",
                f"The format {fmt.name} has no place for lines.",
                "/wires",
                "isoparametric curves as lines",
                "tubes or ribbons, or another format",
            )
        )
    if encode.exact and (options.solid_wires or not options.surface):
        raise UnsupportedByFormat(
            Issue(
                "unsupported_by_format",
                "The exact form holds patches, and lines.",
                "/oogl",
                "wires that have faces, or no surface",
                "the surface, its curves as lines, or another form",
            )
        )


def _check_vertices(size: MeshSize, limits: Limits) -> None:
    """Refuses a mesh that would be too large, its lines included."""
    if size.vertices + size.overlay_points > limits.max_vertices:
        raise TooLarge(
            Issue(
                "too_many_vertices",
                "The mesh would have too many vertices.",
                "/resolution",
                f"{size.vertices + size.overlay_points} vertices",
                f"at most {limits.max_vertices}",
            )
        )


def _check_sweeps(model: Model, options: MeshOptions, limits: Limits) -> None:
    """Refuses curves of so high a degree that their many lengths would take too long."""
    models = model.models if isinstance(model, GroupModel) else (model,)
    count = sum(sweeping.effort(own, options) for own in models if isinstance(own, SweepModel))
    if count > limits.max_multiplications:
        raise TooLarge(
            Issue(
                "too_costly",
                "Curves of so high a degree take long to be measured: with the square of it.",
                "/resolution",
                f"{count} multiplications",
                f"at most {limits.max_multiplications}; fewer divisions, or a lower degree",
            )
        )


def _check_method(model: Model, options: MeshOptions, fmt: Format, limits: Limits) -> None:
    """Refuses a method where there is none, it would take too long, or lose all digits."""
    if options.method == "matrix":
        return
    models = model.models if isinstance(model, GroupModel) else (model,)
    patches = [own for own in models if isinstance(own, PatchModel)]
    if len(patches) < len(models):
        raise InvalidRequest(replace(NOT_PATCHES, pointer="/method"))
    most = forward_difference.MAX_DEGREE[np.float32 if fmt.single else np.float64]
    if options.method == "forward_difference" and highest_degree(model) > most:
        raise InvalidRequest(
            Issue(
                "degree_too_high",
                "Forward differences of so high a degree lose the digits that the format stores.",
                "/method",
                f"degree {highest_degree(model)}",
                f"degrees up to {most}, or another method",
            )
        )
    if options.method == "de_casteljau":
        count = sum(de_casteljau.effort(own, options.resolution) for own in patches)
        if count > limits.max_multiplications:
            raise TooLarge(
                Issue(
                    "too_costly",
                    "De Casteljau's algorithm would take too long: it grows with the third power "
                    "of the degree.",
                    "/method",
                    f"{count} multiplications",
                    f"at most {limits.max_multiplications}; fewer divisions, or another method",
                )
            )


def _check_bytes(size: MeshSize, fmt: Format, encode: EncodeOptions, limits: Limits) -> None:
    """Refuses an answer that would be too large."""
    most = fmt.byte_bound(size, encode)
    if most > limits.max_bytes:
        raise TooLarge(
            Issue(
                "too_many_bytes",
                f"The answer as {fmt.name} could become too large.",
                "/resolution",
                f"up to {most} bytes",
                f"at most {limits.max_bytes}",
            )
        )


def _check_points(query: Query, limits: Limits) -> None:
    """Refuses queries of too many points."""
    count = len(query.places)
    if count > limits.max_points:
        raise TooLarge(
            Issue(
                "too_many_points",
                "The query has more points than this service computes at once.",
                f"/{query.field}",
                f"{count} points",
                f"at most {limits.max_points}",
            )
        )
    most = json_points.byte_bound(count, query.order)
    if most > limits.max_bytes:
        raise TooLarge(
            Issue(
                "too_many_bytes",
                "The answer could become too large.",
                f"/{query.field}",
                f"up to {most} bytes",
                f"at most {limits.max_bytes}",
            )
        )
