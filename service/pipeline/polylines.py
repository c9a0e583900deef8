"""Files of polylines: a curve, and the sections of a surface by planes."""

from dataclasses import replace
from functools import partial

import numpy as np

from service.bases.arrays import Ints
from service.cancellation import checkpoint
from service.encoders.polylines.format import (
    CurveFormat,
    PolylineSize,
    SectionFormat,
    count_sections,
)
from service.engine.curves.polyline import CurveOptions
from service.engine.curves.trace import choose_samples, trace_curve
from service.engine.joining.join import join
from service.engine.options import MeshOptions
from service.engine.parts.sections.cut import cut_part
from service.engine.sections.section import cut_surface
from service.engine.sections.values import Planes, Sections, SectionTolerance
from service.errors import Issue, TooLarge, UnsupportedByFormat, count_nouns
from service.measuring import Measured
from service.pipeline.checks import check_bytes, require_numbered_patches
from service.pipeline.cost import MAX_SCRATCH_BYTES, MEMORY_SHARE, POINT_BYTES, Work, curve_cost
from service.pipeline.limits import DEFAULT_LIMITS, Limits, check_count, check_items
from service.pipeline.parts import check_asked, has_breps, prepare_part, require_exact
from service.pipeline.query_costs import piece_memory, searched_nets, sections_cost
from service.surface.curve import Curve
from service.surface.lowered import PatchModel
from service.surface.sizes import SurfaceKind

EASY_DEGREE = 8
"""Above this degree, the time of each sample grows with the third power of the degree."""

POINT_EFFORT, SQUARE_EFFORT = 3_000, 50
"""The multiplications that measure a curve between two samples are `POINT_EFFORT`, plus
`SQUARE_EFFORT` times the square of the degree."""

MAX_PLANES = 1_000
"""The most planes of a query."""

PIECE_EFFORT, MIN_PIECES = 1200, 500
"""The multiplications for each piece of a section and each control point of its patch; and the
number of pieces that a query may have even if the limits and `MEMORY_SHARE` allow fewer."""

COMPARE_EFFORT, BORDER_EFFORT = 20, 400
"""The multiplications of a test whether a plane may cut a patch; and those that find the sides of a
plane on which a coedge, an edge, or a piece of a curve is."""


def plan_curve(
    curve: Curve, options: CurveOptions, fmt: CurveFormat, limits: Limits = DEFAULT_LIMITS
) -> Work[bytes]:
    """Plan the file of a curve: estimate the cost from shapes, and check the limits.

    Raises
    ------
    TooLarge
        The curve or the file exceeds a limit.
    UnsupportedByFormat
        Only JSON has derivatives, and points at chosen parameters.
    """
    where = f"/{options.field}"
    for pointer, is_asked in (
        ("/parameters", options.parameters is not None),
        ("/derivatives", options.order > 0),
    ):
        if is_asked and not fmt.has_columns:
            message, got = "This format stores lines, and no columns.", "a format of lines"
            raise UnsupportedByFormat(Issue("unsupported_by_format", message, pointer, got, "json"))
    pieces = curve.lower()  # takes no time: the curve was lowered when it was created
    degree, numbers = pieces.degree, pieces.points.size
    slowness = max(1.0, (degree / EASY_DEGREE) ** 3)
    effort = POINT_EFFORT + SQUARE_EFFORT * degree**2

    def count_bytes(points: int) -> int:
        """The most bytes of the file of this number of points."""
        return fmt.byte_bound(PolylineSize(points, len(curve.name.encode()), order=options.order))

    max_points = max(
        2, min(int(limits.max_vertices / slowness), limits.max_multiplications // effort)
    )
    points = pieces.count * options.resolution + 1
    if options.parameters is not None:
        points = len(options.parameters)
        # The length of each piece is measured, too.
        max_points = max(1, min(limits.max_points, max_points - pieces.count))
        check_items("too_many_points", points, max_points, where)
    if options.tolerance is not None:
        # The number of points is known only after sampling: allow the number that fits into a share
        # of the memory. A point takes 1/1,000 of the difference between the bytes of files of
        # 1,001 points and of 1 point.
        point_memory = POINT_BYTES + 2 * (count_bytes(1001) - count_bytes(1)) // 1000
        free_memory = limits.max_memory // MEMORY_SHARE - 8 * numbers - MAX_SCRATCH_BYTES
        points = max_points = max(2, min(max_points, free_memory // point_memory))
    file_bytes = min(count_bytes(points), limits.max_bytes)
    measured = points + pieces.count if options.parameters is not None else points
    cost = curve_cost(measured, degree, numbers, file_bytes)

    def check(points: int) -> None:
        """Refuse a polyline with more points, or a file with more bytes, than allowed."""
        issue = Issue("too_many_vertices", "The polyline would have too many points.", where)
        check_count(points, max_points, "points", issue)
        check_bytes(count_bytes(points), fmt, limits, where)

    if options.tolerance is None:
        check(points)
        instead = "fewer points take less"
        limits.check_memory(cost.memory, "The curve", where, instead)

    def run() -> bytes:
        """Sample the curve, and write the file; refuses a tolerance below the rounding."""
        with Measured("curve"):
            parameters = choose_samples(pieces, options, max_points, is_float32=fmt.is_float32)
        check(len(parameters))
        with Measured("curve"):
            polyline = trace_curve(pieces, parameters, options, is_float32=fmt.is_float32)
        return fmt.encode(polyline)

    return Work(cost, run)


def plan_sections(
    surface: SurfaceKind,
    query: tuple[Planes, SectionTolerance],
    fmt: SectionFormat,
    limits: Limits = DEFAULT_LIMITS,
) -> Work[bytes]:
    """Plan sections: estimate the cost from the shapes of the arrays, and check the limits.

    Raises
    ------
    TooLarge
        The surface or the query exceeds a limit.
    """
    surface = require_exact(surface)
    count, where = len(query[0]), "/planes"
    check_items("too_many_planes", count, MAX_PLANES, where)
    size = check_asked(surface.size(), limits)
    instead = "fewer planes, or a smaller surface"
    effort = COMPARE_EFFORT * count * searched_nets(size).number
    effort += BORDER_EFFORT * count * (size.coedges + size.edges + size.edge_pieces)
    limits.check_effort(effort, "The sections could take too long.", where, instead)
    p, q = size.degree
    net_points = (p + 1) * (q + 1)
    # A piece adds at most 2 points, and `_build_size` has a polyline for each point.
    bytes_of_1000 = fmt.byte_bound(_build_size(2001)) - fmt.byte_bound(_build_size(1))
    piece_bytes = piece_memory(net_points, bytes_of_1000)
    fixed_cost = sections_cost(size, count, 0, piece_bytes)
    limits.check_memory(
        fixed_cost.memory + MIN_PIECES * piece_bytes, "The sections", where, instead
    )
    # The number of pieces is known only after cutting: allow the number that fits into a share of
    # the memory.
    free_memory = (
        max(limits.max_memory // MEMORY_SHARE, fixed_cost.memory + MIN_PIECES * piece_bytes)
        - fixed_cost.memory
    )
    max_pieces = min(limits.max_vertices, limits.max_multiplications // (PIECE_EFFORT * net_points))
    max_pieces = max(MIN_PIECES, min(max_pieces, free_memory // piece_bytes))
    cost = sections_cost(size, count, max_pieces, piece_bytes)
    return Work(cost, partial(_cut, surface, query, fmt, limits, max_pieces))


def _cut(
    surface: SurfaceKind,
    query: tuple[Planes, SectionTolerance],
    fmt: SectionFormat,
    limits: Limits,
    max_pieces: int,
) -> bytes:
    """Compute the sections, of together at most `max_pieces` pieces, and write them to a file.

    Before the planes cut them, patches without trims are joined as for a mesh.

    Raises
    ------
    InvalidRequest
        `not_parametric`: a tube or a ribbon has no patches; `tolerance_too_small`.
    TooLarge
        `too_many_patches`, `too_many_vertices`, `too_many_bytes`.
    """
    planes, tolerance = query
    lowered = surface.lower()

    def check_patches(model: PatchModel) -> None:
        issue = Issue("too_many_patches", "The surface has too many Bézier patches.", "/surface")
        check_count(model.patch_count, limits.max_patches, "patches", issue)

    def check_pieces(count: int) -> None:
        if count > max_pieces:
            raise TooLarge(
                Issue(
                    "too_many_vertices",
                    "Polylines with this tolerance would have too many points.",
                    "/planes" if tolerance.distance is None else "/tolerance",
                    f"more than {count_nouns(max_pieces, 'pieces')}",
                    f"at most {max_pieces}; fewer planes, or a larger tolerance",
                )
            )

    with Measured("intersect"):
        if has_breps(lowered):
            part = prepare_part(lowered)
            distance = tolerance.to_model_units(
                part.bounds, part.diagonal, is_float32=fmt.is_float32
            )
            sections = cut_part(part, planes, distance, check_pieces)
            named = replace(sections, name=lowered.name, up=lowered.up)
            sections = replace(named, skipped_faces=part.skipped_faces)
        else:
            model = require_numbered_patches(lowered)
            distance = tolerance.to_model_units(
                model.bounds, model.diagonal, is_float32=fmt.is_float32
            )
            joined, seams = join(model, MeshOptions().weld_tolerance, check_patches)
            sections = cut_surface(joined, seams, planes, distance, check_pieces)
            sections = _number_coplanar_patches(joined, sections)
    if surface.unit is not None:
        sections = replace(sections, metres_per_unit=surface.unit)
    check_bytes(fmt.byte_bound(count_sections(sections)), fmt, limits, "/tolerance")
    checkpoint()
    return fmt.encode(sections)


def _number_coplanar_patches(model: PatchModel, sections: Sections) -> Sections:
    """The sections, with the numbers in the request of the patches that lie in a plane."""
    if not any(len(section.coplanar) for section in sections.sections):
        return sections
    renumbered = (
        replace(section, coplanar=_number_as_in_request(model, section.coplanar))
        for section in sections.sections
    )
    return replace(sections, sections=tuple(renumbered))


def _build_size(points: int) -> PolylineSize:
    """The size of one section with this number of points, polylines, and patches in the plane."""
    return PolylineSize(
        planes=1,
        polylines=points,
        points=points,
        touching=points,
        coplanar=points,
        name_bytes=0,
    )


def _number_as_in_request(model: PatchModel, patches: Ints) -> Ints:
    """The numbers that patches of a model have in the request.

    In a `multipatch`, the numbers are the numbers of its surfaces.
    """
    if len(model.domains) > 1:
        firsts = np.array([domain.first for domain in model.domains])
        # The surface of a patch is the last one, by first patches, that begins at or before it.
        order = np.argsort(firsts)
        return np.unique(order[np.searchsorted(firsts[order], patches, side="right") - 1])
    return patches if model.request_numbers is None else np.sort(model.request_numbers[patches])
