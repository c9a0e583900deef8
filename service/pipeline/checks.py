"""What a mesh must be before it is computed: possible, in this format, and affordable."""

from dataclasses import replace

import numpy as np

from service.encoders.compression import compressions
from service.encoders.format import EncodeOptions, Format, MeshSize
from service.engine.adaptive.aims import has_sweeps, stated
from service.engine.curvatures.ranges import NAMES
from service.engine.evaluation import de_casteljau, forward_difference
from service.engine.models import NOT_PATCHES, highest_degree, reach
from service.engine.options import MeshOptions
from service.engine.sweeps import sweep
from service.errors import InvalidRequest, Issue, TooLarge, UnsupportedByFormat
from service.pipeline.limits import Limits
from service.surface.checks import MAX_COORDINATE
from service.surface.lowered import GroupModel, Model, PatchModel
from service.surface.sweep_model import SweepModel


def check_wires(model: Model, options: MeshOptions) -> None:
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


def check_curvatures(model: Model, options: MeshOptions) -> None:
    """Refuses curvatures of what is no parametric surface, and a name that is taken."""
    if not options.curvatures:
        return
    if has_sweeps(model):
        raise InvalidRequest(replace(NOT_PATCHES, pointer="/curvatures"))
    models = model.models if isinstance(model, GroupModel) else (model,)
    for own in models:
        channels = own.batches[0].channels if isinstance(own, PatchModel) else ()
        if any(c.kind == "attribute" and c.name.lower() in NAMES for c in channels):
            raise InvalidRequest(
                Issue(
                    "name_clash",
                    "The surface has an attribute of the name that its curvature would get.",
                    "/curvatures",
                    "attributes and curvatures of one name",
                    f"other names than {' and '.join(NAMES)}, or no curvatures",
                )
            )


def check_format(options: MeshOptions, fmt: Format, encode: EncodeOptions) -> None:
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
    _check_compact(fmt, encode)
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


def _check_compact(fmt: Format, encode: EncodeOptions) -> None:
    """Refuses compact forms of what has none, and a compression that is not installed."""
    asked = {"quantize": encode.quantize, "compression": encode.compression != "none"}
    for name, wanted in asked.items():
        if wanted and not fmt.compact:
            raise UnsupportedByFormat(
                Issue(
                    "unsupported_by_format",
                    f"The format {fmt.name} has no compact form.",
                    f"/{name}",
                    name,
                    "nothing here, or one of the formats glb and gltf",
                )
            )
    if encode.compression not in ("none", *compressions()):
        raise UnsupportedByFormat(
            Issue(
                "compression_unavailable",
                "This service was installed without the library that compresses.",
                "/compression",
                encode.compression,
                "none, or a service with the extra named meshopt",
            )
        )


def check_accuracy(model: Model, options: MeshOptions, fmt: Format, encode: EncodeOptions) -> None:
    """Refuses a tolerance or a budget where nothing is divided by it."""
    if options.accuracy is None:
        return
    where = stated(options.accuracy)
    if has_sweeps(model):
        raise InvalidRequest(replace(NOT_PATCHES, pointer=where))
    if options.wired:
        raise _conflict("Isoparametric curves are divided by a resolution.", "/isocurves", where)
    if options.faces == "quads":
        raise _conflict("Meshes by tolerance are made of triangles.", "/faces", where)
    if options.method != "matrix":
        raise _conflict("The methods sample grids, which a resolution makes.", "/method", where)
    if encode.oogl is not None and encode.oogl != "off" and fmt.encode_exact is not None:
        what = "The exact form needs no mesh." if encode.exact else "This form is made of grids."
        raise _conflict(what, "/oogl", where)


def _conflict(message: str, pointer: str, stated_by: str) -> InvalidRequest:
    name = stated_by[1:]
    got, needed = f"this beside {name}", f"one of the two, or nothing here beside {name}"
    return InvalidRequest(Issue("conflicting_options", message, pointer, got, needed))


def check_vertices(size: MeshSize, limits: Limits, where: str = "/resolution") -> None:
    """Refuses a mesh that would be too large, its lines included; `where` asked for it."""
    if size.vertices + size.overlay_points > limits.max_vertices:
        raise TooLarge(
            Issue(
                "too_many_vertices",
                "The mesh would have too many vertices.",
                where,
                f"{size.vertices + size.overlay_points} vertices",
                f"at most {limits.max_vertices}",
            )
        )


def check_sweeps(model: Model, options: MeshOptions, limits: Limits) -> None:
    """Refuses curves of so high a degree that their many lengths would take too long."""
    models = model.models if isinstance(model, GroupModel) else (model,)
    count = sum(sweep.effort(own, options) for own in models if isinstance(own, SweepModel))
    message = "Curves of so high a degree take long to be measured: with the square of it."
    limits.check_effort(count, message, "/resolution", "fewer divisions, or a lower degree")


def check_method(model: Model, options: MeshOptions, fmt: Format, limits: Limits) -> None:
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
        message = (
            "De Casteljau's algorithm would take too long: it grows with the third power of the "
            "degree."
        )
        limits.check_effort(count, message, "/method", "fewer divisions, or another method")


def check_bytes(
    size: MeshSize,
    fmt: Format,
    encode: EncodeOptions,
    limits: Limits,
    where: str = "/resolution",
) -> None:
    """Refuses an answer that would be too large; `where` asked for it."""
    message = f"The answer as {fmt.name} could become too large."
    limits.check_bytes(fmt.byte_bound(size, encode), message, where)
