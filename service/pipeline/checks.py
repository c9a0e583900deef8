"""Checks before a mesh is computed: the options, the format, and the limits of size.

Some checks need only the sizes of the surface's arrays (`SurfaceSize`); others need its patches.
"""

from dataclasses import replace
from functools import partial

import numpy as np

from service.encoders.format import EncodeOptions, FileFormat, Format
from service.encoders.libraries import list_compressions
from service.engine.evaluation import de_casteljau, forward_difference
from service.engine.mesh.mesh import CURVATURE_NAMES
from service.engine.models import NOT_PATCHES, find_largest_coordinate, to_patches
from service.engine.numbering import number_patches
from service.engine.options import MeshOptions
from service.engine.sweeps import sweep
from service.errors import InvalidRequest, Issue, UnsupportedByFormat
from service.pipeline.cost import lowering_memory
from service.pipeline.limits import Limits, check_count
from service.surface.checks import MAX_COORDINATE
from service.surface.curve_model import SweepModel
from service.surface.lowered import GroupModel, Model, PatchModel
from service.surface.sizes import SurfaceSize


def check_surface(size: SurfaceSize, limits: Limits) -> SurfaceSize:
    """The size, unless it has too many patches, or its patches take too much memory."""
    message = "The surface has too many Bézier patches: one for every span of its knots."
    issue = Issue("too_many_patches", message, "/surface")
    check_count(size.patches + size.face_patches, limits.max_patches, "patches", issue)
    message = "The surface has too many faces, each counted for every placement."
    issue = Issue("too_many_placed_faces", message, "/surface")
    check_count(size.placed_faces, limits.max_placed_faces, "faces", issue)
    subject = "As patches the surface"  # `check_memory` adds "would take more memory than …"
    limits.check_memory(lowering_memory(size), subject, "/surface", "a smaller surface")
    return size


def check_options(
    size: SurfaceSize, options: MeshOptions, fmt: Format, encode: EncodeOptions
) -> None:
    """Refuse options that are impossible for a surface of this size, or in this format."""
    if size.curves:  # a tube or a ribbon, or a group that has some
        _check_swept(options, fmt, encode)
    if options.accuracy is not None:
        _check_accuracy(options, options.accuracy.pointer, fmt, encode)
    _check_format(options, fmt, encode)
    degree = max(size.degree)
    max_degree = forward_difference.MAX_DEGREE[np.float32 if fmt.is_float32 else np.float64]
    if options.method == "forward_difference" and degree > max_degree:
        raise InvalidRequest(
            Issue(
                "degree_too_high",
                "Forward differences of so high a degree lose the digits that the format stores.",
                "/method",
                f"degree {degree}",
                f"degrees up to {max_degree}, or another method",
            )
        )


def _check_swept(options: MeshOptions, fmt: Format, encode: EncodeOptions) -> None:
    """Refuse options that need patches, because tubes and ribbons have no patches."""
    where = None
    if encode.exact and fmt.encode_exact is not None:
        where = "/surface"
    elif options.has_wires or not options.has_faces:
        raise InvalidRequest(
            Issue(
                "not_parametric",
                "Tubes and ribbons have no isoparametric curves; they are made of their faces.",
                "/isocurves" if options.has_wires else "/faces",
                "a tube or a ribbon",
                "no isoparametric curves, and faces",
            )
        )
    elif options.curvatures and "attribute" in fmt.carries:
        where = "/curvatures"
    elif options.method != "matrix":
        where = "/method"
    if where is not None:
        raise InvalidRequest(replace(NOT_PATCHES, pointer=where))


def _check_accuracy(options: MeshOptions, where: str, fmt: Format, encode: EncodeOptions) -> None:
    """Refuse options that a mesh by tolerance or by budget cannot have.

    `where` is the JSON pointer to the tolerance or budget.
    """
    no_mesh = "The exact form needs no mesh."
    no_grids = "This form has grids, and a mesh by tolerance has none."
    conflicts = (
        (
            options.faces == "quads",
            "The bound is for triangles, because the corners of a quad need not be in one plane.",
            "/faces",
        ),
        (
            options.method != "matrix",
            "Only a mesh by resolution has grids of samples, which the methods compute.",
            "/method",
        ),
        (
            # Only the format OOGL has an exact form; only its encoder reads the option `oogl`.
            encode.oogl not in (None, "off") and fmt.encode_exact is not None,
            no_mesh if encode.exact else no_grids,
            "/oogl",
        ),
    )
    for is_conflict, message, pointer in conflicts:
        if is_conflict:
            name = where[1:]
            texts = f"this option and {name}", f"only one of the two: this option or {name}"
            raise InvalidRequest(Issue("conflicting_options", message, pointer, *texts))


def _check_format(options: MeshOptions, fmt: Format, encode: EncodeOptions) -> None:
    """Refuse data that the format cannot store, and a compression that is not installed."""
    unsupported = partial(Issue, "unsupported_by_format")
    no_lines = f"The format {fmt.name} has no place for lines."
    compact_option = "quantize" if encode.quantize else "compression"
    refusals = (
        (
            options.faces == "quads" and not fmt.has_quads,
            unsupported(
                f"The format {fmt.name} has only triangles.",
                "/faces",
                "quads",
                "triangles, or another format",
            ),
        ),
        (
            bool(options.overlays) and not fmt.has_overlays,
            unsupported(no_lines, "/overlays", "overlays", "none, or another format"),
        ),
        (
            options.has_wires and not options.has_solid_wires and not fmt.has_overlays,
            unsupported(
                no_lines,
                "/wires",
                "isoparametric curves as lines",
                "tubes or ribbons, or another format",
            ),
        ),
        (
            not fmt.compact and (encode.quantize or encode.compression != "none"),
            unsupported(
                f"The format {fmt.name} has no compact form.",
                f"/{compact_option}",
                compact_option,
                "nothing here, or one of the formats glb and gltf",
            ),
        ),
        (
            encode.compression not in ("none", *list_compressions()),
            Issue(
                "compression_unavailable",
                "This service was installed without the library that compresses.",
                "/compression",
                encode.compression,
                "none, or a service with the extra named meshopt",
            ),
        ),
        (
            encode.exact and (options.has_solid_wires or not options.has_faces),
            unsupported(
                "The exact form holds patches, and lines.",
                "/oogl",
                "wires that have faces, or no surface",
                "the surface, its curves as lines, or another form",
            ),
        ),
    )
    for is_refused, issue in refusals:
        if is_refused:
            raise UnsupportedByFormat(issue)


def check_vertices(vertices: int, limits: Limits, where: str = "/resolution") -> None:
    """Refuse too many vertices, including the points of lines; `where` points to the option."""
    issue = Issue("too_many_vertices", "The mesh would have too many vertices.", where)
    check_count(vertices, limits.max_vertices, "vertices", issue)


def check_bytes(
    byte_bound: int, fmt: FileFormat, limits: Limits, where: str = "/resolution"
) -> None:
    """Refuse a file that may have too many bytes; `where` points to the option."""
    limits.check_bytes(byte_bound, where, f"The response as {fmt.name} could become too large.")


def check_model(model: Model, options: MeshOptions, limits: Limits) -> None:
    """Refuse options that the lowered surface shows to be impossible or too costly.

    The checks are the reach of wires, the names of attributes, and the number of multiplications.
    """
    if (
        options.has_solid_wires
        and (largest_coordinate := find_largest_coordinate(model, options)) > MAX_COORDINATE
    ):
        raise InvalidRequest(
            Issue(
                "coordinate_too_large",
                "Coordinates are stored in single precision.",
                "/wire_width",
                f"wires that reach as far as {largest_coordinate:.6g}",
                f"at most {MAX_COORDINATE:.7g}",
            )
        )
    models = model.models if isinstance(model, GroupModel) else (model,)
    for submodel in models:
        if isinstance(submodel, SweepModel):
            if options.accuracy is not None:
                continue  # the work is counted while the path is divided
            limits.check_effort(
                sweep.estimate_effort(submodel, options),
                "Measuring a curve takes time that grows with the square of its degree.",
                "/resolution",
                "fewer divisions, or a lower degree",
            )
        elif options.curvatures and isinstance(submodel, PatchModel):
            _check_names(submodel)
    if options.method == "de_casteljau":
        patches = [submodel for submodel in models if isinstance(submodel, PatchModel)]
        limits.check_effort(
            sum(de_casteljau.estimate_effort(submodel, options.resolution) for submodel in patches),
            "De Casteljau's algorithm would take too long: it grows with the third power of the "
            "degree.",
            "/method",
            "fewer divisions, or another method",
        )


def _check_names(model: PatchModel) -> None:
    """Refuse a surface with an attribute that has the name of a curvature."""
    channels = model.batches[0].channels
    if any(c.kind == "attribute" and c.name.lower() in CURVATURE_NAMES for c in channels):
        raise InvalidRequest(
            Issue(
                "name_clash",
                "The surface has an attribute with the name of a curvature.",
                "/curvatures",
                "an attribute and a curvature with the same name",
                f"other names than {' and '.join(CURVATURE_NAMES)}, or no curvatures",
            )
        )


def require_patches(model: Model) -> PatchModel:
    """All patches of a model, in its coordinates; the patches of a group become one model.

    Refuses tubes, ribbons and breps (`InvalidRequest`: `not_parametric`).
    """
    try:
        return to_patches(model)
    except InvalidRequest as error:
        raise error.within("/surface") from None


def require_numbered_patches(model: Model) -> PatchModel:
    """All patches of a model, as `require_patches`, with their numbers in the request."""
    try:
        return number_patches(model)
    except InvalidRequest as error:
        raise error.within("/surface") from None


def require_no_sweeps(model: Model) -> None:
    """Refuses tubes and ribbons, also in groups (`InvalidRequest`: `not_parametric`)."""
    models = model.models if isinstance(model, GroupModel) else (model,)
    if any(isinstance(each, SweepModel) for each in models):
        raise InvalidRequest(replace(NOT_PATCHES, pointer="/surface"))
