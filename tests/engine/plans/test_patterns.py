"""Index patterns: their faces tile the parameter square, without gaps or overlaps."""

from fractions import Fraction

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from oracles.topology import count_topology
from service.engine.options import Faces
from service.engine.plans.patterns import Shape, build_faces
from service.engine.plans.strips import Divisions

Place = tuple[Fraction, Fraction]
divisions = st.integers(1, 9)


def list_places(shape: Shape) -> list[Place]:
    """(u, v) of every local index: the grid row by row, then the extra samples of sides."""
    ru, rv = shape.resolution
    grid = [(Fraction(i, ru), Fraction(j, rv)) for i in range(ru + 1) for j in range(rv + 1)]
    zero, one = Fraction(0), Fraction(1)
    for side, count in enumerate(shape.sides):
        if count == shape.grid_divisions[side]:
            continue  # all samples of the side are in the grid
        for k in range(1, count):
            # The sides 0 to 3 are u = 0, u = 1, v = 0 and v = 1.
            t, end = Fraction(k, count), one if side % 2 else zero
            grid.append((end, t) if side < 2 else (t, end))
    return grid


def compute_double_area(loop: list[Place]) -> Fraction:
    """Twice the signed area of a polygon."""
    pairs = zip(loop, loop[1:] + loop[:1], strict=True)
    return sum((a[0] * b[1] - b[0] * a[1] for a, b in pairs), Fraction(0))


def check_tiling(shape: Shape, kind: Faces) -> None:
    """Checks that the faces are counter-clockwise, have areas, and tile the unit square."""
    triangles, quads = build_faces(shape, kind)
    places = list_places(shape)
    loops = [*triangles.tolist(), *quads.tolist()]
    double_areas = [compute_double_area([places[i] for i in loop]) for loop in loops]
    assert min(double_areas) > 0
    assert sum(double_areas) == 2
    # Indices at one place are merged, because extra samples may be at places of grid samples.
    first: dict[Place, int] = {}
    first_index = [first.setdefault(place, k) for k, place in enumerate(places)]
    topology = count_topology([[first_index[i] for i in loop] for loop in loops])
    assert (topology.euler, topology.components, topology.boundary) == (1, 1, sum(shape.sides))
    assert (topology.non_manifold, topology.misoriented, topology.degenerate) == (0, 0, 0)


@given(divisions, divisions, st.sampled_from(["triangles", "quads"]))
def test_a_plain_grid_tiles_the_square(ru: int, rv: int, kind: Faces) -> None:
    """Each cell has two triangles or one quad."""
    shape = Shape((ru, rv), (rv, rv, ru, ru))
    check_tiling(shape, kind)
    triangles, quads = build_faces(shape, kind)
    expected = (0, ru * rv) if kind == "quads" else (2 * ru * rv, 0)
    assert (len(triangles), len(quads)) == expected


@given(
    divisions, divisions, st.tuples(*[st.booleans()] * 4), st.sampled_from(["triangles", "quads"])
)
def test_strips_join_sides_with_more_divisions_to_the_grid(
    ru: int, rv: int, are_finer: tuple[bool, bool, bool, bool], kind: Faces
) -> None:
    """Each side may have the larger of the two numbers of divisions.

    A stitched grid needs an inner line of samples. So a grid of one division gets a second one, and
    a side may then have fewer divisions than the grid.
    """
    sides: Divisions = tuple(  # type: ignore[assignment]
        max(ru, rv) if is_finer else own_divisions
        for is_finer, own_divisions in zip(are_finer, (rv, rv, ru, ru), strict=True)
    )
    assume(sides != (rv, rv, ru, ru))  # else the grid has no strips
    check_tiling(Shape((max(ru, 2), max(rv, 2)), sides), kind)


@pytest.mark.parametrize("kind", ["triangles", "quads"])
@pytest.mark.parametrize("side", range(4))
def test_faces_without_area_at_a_collapsed_side_are_omitted(side: int, kind: Faces) -> None:
    """Each cell at the side has one triangle less, or a triangle in place of a quad."""
    ru, rv = 4, 3
    count = (rv, rv, ru, ru)[side]  # the cells along the sides u = 0, u = 1, v = 0 and v = 1
    collapsed = tuple(k == side for k in range(4))
    shape = Shape((ru, rv), (rv, rv, ru, ru), collapsed)  # type: ignore[arg-type]
    triangles, quads = build_faces(shape, kind)
    if kind == "quads":
        assert (len(quads), len(triangles)) == (ru * rv - count, count)
    else:
        assert len(triangles) == 2 * ru * rv - count
    number = np.arange((ru + 1) * (rv + 1)).reshape(ru + 1, rv + 1)
    pole = (number[0], number[-1], number[:, 0], number[:, -1])[side]
    for face in [*triangles.tolist(), *quads.tolist()]:
        assert len(set(face) & set(pole.tolist())) <= 1


def test_equal_shapes_share_one_read_only_pattern() -> None:
    """The cache returns the same array for an equal shape."""
    shape = Shape((5, 4), (4, 4, 5, 5))
    triangles, _ = build_faces(shape, "triangles")
    assert build_faces(Shape((5, 4), (4, 4, 5, 5)), "triangles")[0] is triangles
    assert triangles.dtype == np.uint32
    with pytest.raises(ValueError, match="read-only"):
        triangles[0] = 0
