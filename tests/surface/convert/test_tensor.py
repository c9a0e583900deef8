"""Operations on tensor-product patches keep points and channels, and edges stay shared."""

from collections.abc import Sequence
from fractions import Fraction
from functools import partial

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from service.engine.options import MeshOptions
from service.engine.tessellate import tessellate
from service.errors import SurfaceError, TooLarge
from service.surface.bezier import BezierSurface
from service.surface.convert.nets import SizeLimits
from service.surface.convert.operations import (
    Elevate,
    Operation,
    Restrict,
    Reverse,
    Split,
    ToBezier,
    Transpose,
)
from service.surface.convert.table import CONVERSIONS, convert
from service.surface.examples.catalogue import EXAMPLES, find
from service.surface.kinds import Surface
from service.surface.patches import PatchSurface
from tests.engine.meshing import build_mesh
from tests.surface.convert.exact import (
    assert_same,
    build_bezier_evaluator,
    build_patch_evaluator,
    convert_to,
    random_bezier,
    random_patches,
)
from tools.examples import lower_patches

degrees = st.tuples(st.integers(1, 4), st.integers(1, 4))
seeds = st.integers(0, 10**6)
inner_parameters = st.floats(0.05, 0.95)
cuts = st.tuples(inner_parameters, st.none() | inner_parameters) | st.tuples(
    st.none(), inner_parameters
)
ends = st.lists(st.floats(0, 1), min_size=2, max_size=2, unique=True).map(sorted)


convert_to_bezier = partial(convert_to, BezierSurface)
convert_to_patches = partial(convert_to, PatchSurface)


def read_issue(surface: Surface, *operations: Operation, points: int = 10**6) -> tuple[str, str]:
    """Code and pointer of the only issue with which the conversion is refused."""
    with pytest.raises(SurfaceError) as caught:
        convert(surface, operations, SizeLimits(points))
    (issue,) = caught.value.issues
    assert issue.got
    assert issue.needed
    return issue.code, issue.pointer


@settings(max_examples=6)
@given(degrees, st.integers(4, 6), seeds, st.booleans())
def test_elevation_of_patches_keeps_points_and_their_shared_edge(
    degree: tuple[int, int], new_degree: int, seed: int, is_rational: bool
) -> None:
    surface = random_patches(degree, seed, is_rational)
    result = convert_to_patches(surface, Elevate((new_degree, new_degree)))
    assert result.degree == (new_degree, new_degree)
    assert result.parts == surface.parts
    assert len(result.vertices) == (2 * new_degree + 1) * (new_degree + 1), (
        "the patches share the vertices of their edge"
    )
    for patch in (0, 1):
        assert_same(build_patch_evaluator(result, patch), build_patch_evaluator(surface, patch))


@settings(max_examples=6)
@given(degrees, seeds, st.booleans(), cuts)
def test_parts_of_a_split_patch_have_its_points_and_share_edges(
    degree: tuple[int, int], seed: int, is_rational: bool, cuts: tuple[float | None, float | None]
) -> None:
    surface = random_bezier(degree, seed, is_rational)
    u, v = cuts
    pieces = convert_to_patches(surface, Split(u, v))
    borders = [[Fraction(0), *([] if t is None else [Fraction(t)]), Fraction(1)] for t in (u, v)]
    counts = [len(b) - 1 for b in borders]
    assert len(pieces.patches) == counts[0] * counts[1]
    rows, columns = (n * d + 1 for n, d in zip(counts, pieces.degree, strict=True))
    assert len(pieces.vertices) == rows * columns
    for k in range(counts[0]):
        for m in range(counts[1]):
            begins = borders[0][k], borders[1][m]
            widths = borders[0][k + 1] - begins[0], borders[1][m + 1] - begins[1]
            assert_same(
                build_patch_evaluator(pieces, k * counts[1] + m),
                build_bezier_evaluator(surface),
                partial(_map_into_interval, begins, widths),
            )


def _map_into_interval(
    begins: Sequence[Fraction], widths: Sequence[Fraction], u: Fraction, v: Fraction
) -> tuple[Fraction, Fraction]:
    """The parameters (u, v) of a patch over part of a domain, as parameters of the whole domain.

    The part begins at `begins` and has these widths.
    """
    return begins[0] + u * widths[0], begins[1] + v * widths[1]


@settings(max_examples=6)
@given(degrees, seeds, st.booleans(), ends, ends)
def test_a_restricted_patch_has_the_points_of_the_patch(
    degree: tuple[int, int], seed: int, is_rational: bool, u: list[float], v: list[float]
) -> None:
    surface = random_bezier(degree, seed, is_rational)
    piece = convert_to_bezier(surface, Restrict((u[0], u[1]), (v[0], v[1])))
    assert piece.degree == degree
    begins = Fraction(u[0]), Fraction(v[0])
    widths = Fraction(u[1]) - begins[0], Fraction(v[1]) - begins[1]
    assert_same(
        build_bezier_evaluator(piece),
        build_bezier_evaluator(surface),
        partial(_map_into_interval, begins, widths),
    )


@settings(max_examples=5)
@given(degrees, seeds, st.booleans())
def test_transposed_and_reversed_patches_have_the_same_points(
    degree: tuple[int, int], seed: int, is_rational: bool
) -> None:
    surface = random_bezier(degree, seed, is_rational)
    expected = build_bezier_evaluator(surface)
    assert_same(
        build_bezier_evaluator(convert_to_bezier(surface, Transpose())),
        expected,
        lambda u, v: (v, u),
    )
    assert_same(
        build_bezier_evaluator(convert_to_bezier(surface, Reverse("u"))),
        expected,
        lambda u, v: (1 - u, v),
    )
    assert_same(
        build_bezier_evaluator(convert_to_bezier(surface, Reverse("v"))),
        expected,
        lambda u, v: (u, 1 - v),
    )
    patches = random_patches(degree, seed, is_rational)
    for patch in (0, 1):
        expected = build_patch_evaluator(patches, patch)
        result = build_patch_evaluator(convert_to_patches(patches, Transpose()), patch)
        assert_same(result, expected, lambda u, v: (v, u))
        result = build_patch_evaluator(convert_to_patches(patches, Reverse("u")), patch)
        assert_same(result, expected, lambda u, v: (1 - u, v))
        result = build_patch_evaluator(convert_to_patches(patches, Reverse("v")), patch)
        assert_same(result, expected, lambda u, v: (u, 1 - v))


@pytest.mark.parametrize("size", [5e-324, 1e-310, 1e-30, 1e30, 1e308])
def test_a_common_factor_of_weights_has_no_effect(size: float) -> None:
    """Factors include subnormal floats, and floats whose sum would be infinite."""
    polynomial = random_bezier((2, 2), 3, False, has_channels=False)
    weights = np.array([[1.0, 1, 1], [1, 1, 1], [1, 1, 1]]) * size
    surface = BezierSurface(polynomial.control_net, weights, "z", "sail")
    for operation in (Elevate((4, 4)), Restrict(u=(0.25, 0.5))):
        result, expected = (
            convert_to_bezier(s, operation).control_net for s in (surface, polynomial)
        )
        np.testing.assert_allclose(result, expected, atol=1e-14)


def test_elevation_that_would_open_a_seam_between_u_and_v_is_refused() -> None:
    """The edge v = 0 of one patch is the edge u = 0 of the other."""
    vertices = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0], [0, -1, 0], [1, -1, 1]])
    surface = PatchSurface(vertices, np.array([[[0, 2], [1, 3]], [[0, 1], [4, 5]]]))
    assert read_issue(surface, Elevate((2, 3))) == ("seam_would_open", "/operations/0/degree")
    reversed_edge = PatchSurface(vertices, np.array([[[0, 2], [1, 3]], [[1, 0], [5, 4]]]))
    assert read_issue(reversed_edge, Elevate((2, 3))) == ("seam_would_open", "/operations/0/degree")
    report = tessellate(
        lower_patches(convert(surface, [Elevate((3, 3))])), MeshOptions(resolution=(2, 2))
    ).report
    assert report.boundary_edges == 6 * 2  # six open sides of two divisions


ELEVATED_EXAMPLES = [
    name for name, example in EXAMPLES.items() if type(example.surface()) in CONVERSIONS[Elevate]
]


@pytest.mark.parametrize("example", ELEVATED_EXAMPLES)
def test_conversions_of_examples_keep_vertices_open_edges_and_poles(example: str) -> None:
    """The numbers are those of the mesh of 3 × 3 divisions before and after the conversion."""
    surface = find(example).surface()
    before = build_mesh(surface.lower(), resolution=(3, 3)).report
    degree = 1 + max(max(batch.side_degrees) for batch in lower_patches(surface).batches)
    conversions: list[list[Operation]] = [
        [Elevate((degree, degree))],
        [Reverse("v"), Transpose()],
        [ToBezier()],
    ]
    for operations in conversions:
        result = convert(surface, operations)
        after = build_mesh(result.lower(), resolution=(3, 3)).report
        assert (after.vertices, after.boundary_edges, after.watertight, after.poles_repaired) == (
            before.vertices, before.boundary_edges, before.watertight, before.poles_repaired,
        )  # fmt: skip


@pytest.mark.parametrize("operation", [Split(0.5), Restrict(u=(0, 0.5))])
def test_operations_at_a_parameter_are_refused_for_several_patches(operation: Operation) -> None:
    surface = random_patches((2, 2), 1, False)
    assert read_issue(surface, operation) == ("several_patches", "/operations/0")


def test_the_error_for_several_patches_counts_each_kind_in_its_number() -> None:
    grid, triangle = np.array([[0, 1], [2, 3]]), np.array([0, 1, 2])
    for grid_count, triangle_count, got in (
        (0, 1, "0 four-sided patches and 1 triangle"),
        (1, 2, "1 four-sided patch and 2 triangles"),
        (2, 0, "2 four-sided patches and 0 triangles"),
    ):
        grids, triangles = np.stack([grid] * 2)[:grid_count], np.stack([triangle] * 2)
        surface = PatchSurface(np.eye(4, 3), grids, triangles=triangles[:triangle_count])
        with pytest.raises(SurfaceError) as caught:
            convert(surface, [Restrict(u=(0, 0.5))])
        assert caught.value.issues[0].got == got


def test_too_large_results_are_refused_before_they_are_built() -> None:
    """Each limit is one less than the number of control points; shared points count twice."""
    surface = random_patches((3, 3), 1, False)
    limit = 2 * 65**2 - 1
    assert read_issue(surface, Transpose(), Elevate((64, 64)), points=limit) == (
        "too_many_control_points",
        "/operations/1",
    )
    assert len(convert_to_patches(surface, Elevate((12, 12))).patches) == 2
    with pytest.raises(TooLarge):
        convert(random_bezier((3, 3), 1, False), [Split(0.5, 0.5)], SizeLimits(4 * 4**2 - 1))
    with pytest.raises(TooLarge):
        convert(random_bezier((3, 3), 1, False), [Elevate((7, 7))], SizeLimits(8**2 - 1))


def test_a_split_above_the_degree_limit_names_the_operation() -> None:
    """A split has no field `degree`, so the error has the pointer of the operation."""
    with pytest.raises(SurfaceError) as caught:
        convert(random_bezier((3, 2), 1, False), [Split(u=0.5)], SizeLimits(degree=2))
    issue = caught.value.issues[0]
    assert (issue.code, issue.pointer) == ("degree_too_high", "/operations/0")
