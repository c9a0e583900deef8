"""Meshes of breps: their default accuracy, and the options that they cannot have."""

from dataclasses import replace

from service.encoders.format import EncodeOptions, Format
from service.engine.accuracy import Accuracy
from service.engine.options import MeshOptions
from service.errors import InvalidRequest, Issue, TooLarge, count_nouns
from service.pipeline.brep_cost import estimate_preparation
from service.pipeline.limits import Limits
from service.pipeline.mesh_costs import EFFORT_FACTOR
from service.surface.sizes import SurfaceSize

DEFAULT_ACCURACY = Accuracy(relative_tolerance=0.001)
"""The accuracy of a mesh of breps, if the request names none."""

DEFAULT_OPTIONS = MeshOptions()

NEEDED_ACCURACY = "`tolerance`, `relative_tolerance`, `max_triangles` or `max_bytes`"


def settle_accuracy(size: SurfaceSize, options: MeshOptions) -> MeshOptions:
    """The options with the default accuracy, if the surface has breps and the request none."""
    if size.faces and options.accuracy is None:
        return replace(options, accuracy=DEFAULT_ACCURACY)
    return options


def check_preparation(size: SurfaceSize, limits: Limits) -> None:
    """Refuse breps that take too much work or time (`TooLarge`: `too_costly`)."""
    if size.faces > limits.max_mesh_faces:
        raise TooLarge(
            Issue(
                "too_costly",
                "A mesh of this number of faces takes longer than one request may.",
                "/surface",
                count_nouns(size.faces, "faces"),
                f"at most {limits.max_mesh_faces}; with `Prefer: respond-async` a job, which has "
                "more time",
            )
        )
    check_edges(size, limits)


def check_edges(size: SurfaceSize, limits: Limits) -> None:
    """Refuse breps that take too much work to be prepared (`TooLarge`: `too_costly`)."""
    if size.faces:
        limits.check_effort(
            estimate_preparation(size) // EFFORT_FACTOR,
            "A brep with this number of edges takes too much work before anything else.",
            "/surface",
            "a part with fewer edges",
        )


def check_brep_options(
    size: SurfaceSize, options: MeshOptions, fmt: Format, encode: EncodeOptions
) -> None:
    """Refuse options that need patches, if the surface is a brep or a group that has some.

    Raises
    ------
    InvalidRequest
        `not_parametric`.
    """
    if not size.faces:
        return
    no_grid = "A brep is meshed by tolerance: its faces are trimmed, so they have no grids."
    no_curves = "Isoparametric curves belong to whole surfaces; faces of a brep are trimmed."
    is_exact = encode.exact and fmt.encode_exact is not None
    edges = '`overlays` with "boundary", which draws all edges of the brep'
    has_resolution = options.has_resolution or options.resolution != DEFAULT_OPTIONS.resolution
    refusals = (
        (has_resolution, "/resolution", no_grid, "a resolution", NEEDED_ACCURACY),
        (options.faces == "quads", "/faces", no_grid, "quads", "triangles"),
        (options.method != "matrix", "/method", no_grid, "a method of grids", "no `method`"),
        (options.has_wires, "/isocurves", no_curves, "isoparametric curves", edges),
        (options.wires != "lines", "/wires", no_curves, options.wires, edges),
        (
            "control_net" in options.overlays,
            "/overlays",
            "A brep has no control net; each surface of its faces has one.",
            "control_net",
            edges,
        ),
        (
            not options.weld,
            "/weld",
            "Only samples of patches can be separate vertices; the faces of a brep share theirs.",
            "false",
            "true, or nothing here; `crease_angle` 0 separates vertices where normals differ",
        ),
        (
            is_exact,
            "/oogl",
            "The exact form has whole patches, and the faces of a brep are trimmed.",
            "bez",
            "another form; POST /v1/convert with the operation `untrim` returns a whole surface",
        ),
    )
    for is_refused, where, message, got, needed in refusals:
        if is_refused:
            raise InvalidRequest(Issue("not_parametric", message, where, got, needed))
