"""Files of surfaces as they are defined: STEP, IGES, VTU; after a conversion, or without change."""

from collections.abc import Sequence
from dataclasses import replace

from service.encoders.cad.format import DefinitionFormat, WritingReport, WrittenFile
from service.errors import InvalidRequest, Issue
from service.pipeline.checks import check_surface
from service.pipeline.conversion_costs import conversion_points
from service.pipeline.cost import Cost, Work, lowering_memory, with_scratch
from service.pipeline.documents import limit_conversion
from service.pipeline.limits import DEFAULT_LIMITS, Limits
from service.pipeline.orienting import Orienter
from service.surface.convert.nets import SizeLimits
from service.surface.convert.operations import Operation
from service.surface.convert.table import convert
from service.surface.kinds import Surface
from service.surface.sizes import SurfaceSize

NET_MEMORY = 6_000
"""Bytes for each net while its borders become edges."""

BASE_SECONDS, NET_SECONDS, BYTE_SECONDS = 4e-3, 1e-3, 3e-8
"""Coarse and safe: the time for any file, for each net or face with its edges, and for each byte.
The patches of a smooth spline take most: their borders, which meet, are found to be one edge."""

NET_BYTES = 1_000
"""The fewest bytes of a net with its edges in a file."""

POINTS_IN_NET = 4
"""The fewest control points of a net."""

NOT_SPLINES = Issue(
    "not_parametric",
    "Tubes and ribbons are no splines: only their meshes can be written.",
    "/surface",
    "a tube or a ribbon",
    "patches, splines or breps; POST /v1/mesh writes meshes",
)

NOT_TRIMMED = Issue(
    "unsupported_by_format",
    "This format stores whole patches, and no faces that are trimmed.",
    "/format",
    "a brep",
    "the whole surface of one face, with the operation `untrim`; or the format step or iges",
)


def plan_cad_file(
    surface: Surface,
    operations: Sequence[Operation],
    allowed: SizeLimits,
    fmt: DefinitionFormat,
    limits: Limits = DEFAULT_LIMITS,
) -> Work[WrittenFile]:
    """Plan a file: estimate the cost from shapes, and check the limits.

    The work checks the bytes of the file again before they are written, when the faces, edges and
    instances are counted.

    Raises
    ------
    InvalidRequest
        `not_parametric` for tubes and ribbons, `unsupported_by_format` for breps in formats of
        patches; with operations, also the errors of `plan_conversion`.
    TooLarge
        The surface exceeds a limit.
    """
    where = "/operations" if operations else "/surface"
    if operations:
        allowed, cost = limit_conversion(surface, operations, allowed, limits)
        size = surface.size()
        points = min(allowed.control_points, conversion_points(size, operations))
        nets = size.faces + points // POINTS_IN_NET
        size = replace(size, net_points=points, nets=nets)
    else:
        # Members in other colours, and stretched ones, are written again: allow for each of them.
        size = surface.size()
        _check_kind(size, fmt)
        stored = check_surface(surface.stored_size(), limits)
        cost, nets = Cost(lowering_memory(stored), 0.0), stored.nets
    file_bytes = min(fmt.estimate(size), limits.max_bytes)
    nets = min(nets, file_bytes // NET_BYTES)
    memory = cost.memory + with_scratch(file_bytes + NET_MEMORY * nets)
    seconds = BASE_SECONDS + NET_SECONDS * nets + BYTE_SECONDS * file_bytes + cost.seconds

    def run() -> WrittenFile:
        converted = surface
        if operations:
            converted = convert(surface, operations, allowed, Orienter(limits).orient)
            _check_kind(converted.size(), fmt)
            check_surface(converted.stored_size(), limits)
        model = converted.lower()

        def allow(byte_bound: int) -> None:
            limits.check_bytes(byte_bound, where, "The file could become too large.")

        try:
            return fmt.encode(model, converted.unit, allow)
        except InvalidRequest as error:
            raise error.within("/surface") from None

    return Work(Cost(memory, seconds), run)


def count_writing(report: WritingReport) -> str:
    """Counts and the unit of a report of writing, as a dictionary of RFC 8941."""
    values = f"faces={report.faces}; definitions={report.definitions}"
    values += f"; instances={report.instances}"
    if report.metres_per_unit is not None:
        values += f"; metres_per_unit={report.metres_per_unit!r}"
    return f"{values}; unit=assumed" if report.is_unit_assumed else values


def _check_kind(size: SurfaceSize, fmt: DefinitionFormat) -> None:
    """Refuse surfaces that the format cannot store."""
    if size.curves:
        raise InvalidRequest(NOT_SPLINES)
    if size.faces and not fmt.has_trims:
        raise InvalidRequest(NOT_TRIMMED)
