"""B-spline curves and surfaces: with knots, Bézier, uniform and quasi-uniform ones.

References
----------
ISO 10303-42, clauses 4.4.40 to 4.4.46 (curves) and 4.4.71 to 4.4.77 (surfaces).
"""

from collections.abc import Sequence

from service.bases.arrays import FloatArray
from service.decoders.cad.content import Curve, Surface
from service.decoders.cad.knot_vectors import (
    KnotKind,
    check_degree,
    expand_knots,
    imply_knots,
)
from service.decoders.cad.splines import build_curve, build_surface
from service.decoders.step.entities import Entities, Entity
from service.decoders.step.faults import Fault
from service.decoders.step.records import (
    Parameter,
    as_integer,
    as_list,
    as_numbers,
    as_references,
)

_IMPLIED: dict[str, KnotKind] = {
    "BEZIER": "bezier",
    "UNIFORM": "uniform",
    "QUASI_UNIFORM": "quasi_uniform",
}
_MAX_MULTIPLICITY = 1000


def is_spline(entity: Entity, kind: str) -> bool:
    """Whether an entity is a spline; `kind` is CURVE or SURFACE."""
    parts = entity.parts
    return f"B_SPLINE_{kind}" in parts or any(
        word in parts
        for word in (
            f"B_SPLINE_{kind}_WITH_KNOTS",
            f"BEZIER_{kind}",
            f"UNIFORM_{kind}",
            f"QUASI_UNIFORM_{kind}",
        )
    )


def read_spline_curve(entities: Entities, entity: Entity) -> Curve:
    """The curve of a B_SPLINE_CURVE or one of its subtypes.

    Raises
    ------
    InvalidGeometry
    """
    own, knot_data, weights = _split(entity, "CURVE", 5, 3)
    degree = as_integer(own[0])
    numbers = as_references(own[1])
    check_degree(degree, len(numbers))
    points = entities.points(numbers)
    if knot_data is not None:
        multiplicities, values = as_numbers(knot_data[0]), as_numbers(knot_data[1])
        knots = _expand(values, multiplicities, degree, len(numbers))
    else:
        knots = _imply(entity, "CURVE", degree, len(numbers))
    return build_curve(degree, knots, points, None if weights is None else as_numbers(weights))


def read_spline_surface(entities: Entities, entity: Entity) -> Surface:
    """The surface of a B_SPLINE_SURFACE or one of its subtypes.

    Raises
    ------
    InvalidGeometry
    """
    own, knot_data, weights = _split(entity, "SURFACE", 7, 5)
    degrees = as_integer(own[0]), as_integer(own[1])
    rows = [as_references(row) for row in as_list(own[2])]
    counts = len(rows), len(rows[0]) if rows else 0
    if any(len(row) != counts[1] for row in rows):
        raise Fault("the rows of a control net differ in length")
    for degree, count in zip(degrees, counts, strict=True):
        check_degree(degree, count)
    flat = [number for row in rows for number in row]
    points = entities.points(flat).reshape(*counts, 3)
    if knot_data is not None:
        u_multiplicities, v_multiplicities, u_values, v_values = map(as_numbers, knot_data[:4])
        knots = (
            _expand(u_values, u_multiplicities, degrees[0], counts[0]),
            _expand(v_values, v_multiplicities, degrees[1], counts[1]),
        )
    else:
        knots = (
            _imply(entity, "SURFACE", degrees[0], counts[0]),
            _imply(entity, "SURFACE", degrees[1], counts[1]),
        )
    net = None if weights is None else [as_numbers(row) for row in as_list(weights)]
    if net is not None and [len(row) for row in net] != [counts[1]] * counts[0]:
        raise Fault("there is not one weight for each control point")
    return build_surface(degrees, knots, points, net)


def _split(
    entity: Entity, kind: str, own_count: int, knot_count: int
) -> tuple[Sequence[Parameter], Sequence[Parameter] | None, Parameter | None]:
    """Attributes of B_SPLINE_…, those of …_WITH_KNOTS, and the weights.

    Parameters
    ----------
    own_count, knot_count : int
        How many attributes the two types have.
    """
    parts = entity.parts
    knotted = f"B_SPLINE_{kind}_WITH_KNOTS"
    rational = parts.get(f"RATIONAL_B_SPLINE_{kind}")
    if f"B_SPLINE_{kind}" in parts and len(parts) > 1:
        own: Sequence[Parameter] = parts[f"B_SPLINE_{kind}"]
        knot_data: Sequence[Parameter] | None = parts.get(knotted)
        weights = rational[0] if rational else None
    elif len(parts) > 1:
        raise Fault("a spline lacks its control points")
    else:
        # A simple instance: the name, and the attributes of all types in one record.
        (parameters,) = parts.values()
        own = parameters[1 : 1 + own_count]
        rest = parameters[1 + own_count :]
        knot_data = rest[:knot_count] if knotted in parts else None
        weights = rest[0] if rational is not None and rest else None
    if len(own) < own_count or (knot_data is not None and len(knot_data) < knot_count - 1):
        raise Fault("a parameter is missing")
    return own, knot_data, weights


def _expand(
    values: Sequence[float], multiplicities: Sequence[float], degree: int, count: int
) -> FloatArray:
    if any(each != int(each) or each > _MAX_MULTIPLICITY for each in multiplicities):
        raise Fault("a multiplicity is not a small whole number")
    return expand_knots(values, [int(each) for each in multiplicities], degree, count)


def _imply(entity: Entity, kind: str, degree: int, count: int) -> FloatArray:
    for word, implied in _IMPLIED.items():
        if f"{word}_{kind}" in entity.parts:
            return imply_knots(implied, degree, count)
    raise Fault("a spline has no knots")
