"""Operations on triangles, and on triangles with patches, keep points and channels."""

from collections.abc import Sequence
from fractions import Fraction
from functools import partial

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from oracles.exact import Vector
from oracles.triangles import to_exact_triangle, value
from service.bases.triangle import count_points
from service.errors import SurfaceError
from service.surface.bezier import BezierSurface, TriangleSurface
from service.surface.channels import Channels
from service.surface.convert.nets import SizeLimits
from service.surface.convert.operations import (
    Elevate,
    Half,
    Operation,
    Restrict,
    Reverse,
    Split,
    ToBezier,
    ToTriangle,
    Transpose,
)
from service.surface.convert.table import convert
from service.surface.patches import PatchSurface
from tests.engine.meshing import build_mesh
from tests.surface.convert.exact import (
    assert_same,
    build_bezier_evaluator,
    build_patch_evaluator,
    convert_to,
    random_bezier,
)

THIRD = Fraction(1, 3)
PLACES = (
    (Fraction(1), Fraction(0), Fraction(0)),
    (Fraction(0), THIRD, 2 * THIRD),
    (Fraction(1, 2), Fraction(0), Fraction(1, 2)),
    (Fraction(1, 5), Fraction(3, 10), Fraction(1, 2)),
)
degrees = st.integers(1, 4)
seeds = st.integers(0, 10**6)


def random_triangle(degree: int, seed: int, is_rational: bool) -> TriangleSurface:
    """A random triangle with channels of degrees 2, 1 and 0."""
    rng = np.random.default_rng(seed)
    count = count_points(degree)
    return TriangleSurface(
        rng.uniform(-4, 4, (count, 3)),
        rng.uniform(0.2, 5, count) if is_rational else None,
        "z",
        "sail",
        Channels(
            rng.uniform(0, 1, (6, 3)),
            rng.uniform(-1, 1, (3, 2)),
            (("heat", rng.uniform(-4, 4, (1, 1))),),
        ),
    )


def build_mixed_patches(seed: int, is_rational: bool) -> PatchSurface:
    """A bicubic patch and a cubic triangle that share an edge."""
    rng = np.random.default_rng(seed)
    edge = [3, 7, 11, 15]  # the side v = 1 of the patch is the side t = 0 of the triangle
    triangle = [*edge, *range(16, 22)]
    return PatchSurface(
        rng.uniform(-4, 4, (22, 3)),
        np.arange(16).reshape(1, 4, 4),
        rng.uniform(0.2, 5, 22) if is_rational else None,
        parts=(("fin", (1,)),),
        up="z",
        name="sail",
        channels=Channels(rng.uniform(0, 1, (22, 3))),
        triangles=np.array([triangle]),
    )


def evaluate_values(
    net: np.ndarray, weights: np.ndarray | None, channels: Sequence[np.ndarray], place: Vector
) -> list[float]:
    """The point at barycentric coordinates `place`, then the values of the channels."""
    result = value(to_exact_triangle(net, weights), place)
    if weights is not None:
        result = tuple(x / result[3] for x in result[:3])
    for channel in channels:
        result += value(to_exact_triangle(channel), place)
    return [float(x) for x in result]


def evaluate_triangle(surface: TriangleSurface, place: Vector) -> list[float]:
    """The point at barycentric coordinates `place`, then the values of the channels."""
    nets = [net for _, _, _, net in surface.channels.each()]
    return evaluate_values(surface.control_net, surface.weights, nets, place)


def evaluate_indexed_triangle(surface: PatchSurface, number: int, place: Vector) -> list[float]:
    """Point and channels of the triangle with this number among the triangles of the surface."""
    rows = surface.triangles[number]
    nets = [values[rows] for _, _, _, values in surface.channels.each()]
    weights = None if surface.weights is None else surface.weights[rows]
    return evaluate_values(surface.vertices[rows], weights, nets, place)


def assert_near(actual: list[float], expected: list[float]) -> None:
    """Checks that values differ by at most 1e-12 times 4, the largest coordinate."""
    np.testing.assert_allclose(actual, expected, rtol=0, atol=4e-12)


convert_to_triangle = partial(convert_to, TriangleSurface)
convert_to_patches = partial(convert_to, PatchSurface)


@settings(max_examples=6)
@given(degrees, st.integers(0, 4), seeds, st.booleans())
def test_elevation_of_a_triangle_keeps_its_points(
    degree: int, degree_steps: int, seed: int, is_rational: bool
) -> None:
    surface = random_triangle(degree, seed, is_rational)
    result = convert_to_triangle(surface, Elevate((degree + degree_steps, degree + degree_steps)))
    assert result.degree == degree + degree_steps
    for place in PLACES:
        assert_near(evaluate_triangle(result, place), evaluate_triangle(surface, place))


@settings(max_examples=6)
@given(degrees, seeds, st.booleans(), st.tuples(*[st.integers(1, 9)] * 3))
def test_parts_of_a_split_triangle_have_its_points_and_share_edges(
    degree: int, seed: int, is_rational: bool, shares: tuple[int, int, int]
) -> None:
    surface = random_triangle(degree, seed, is_rational)
    r, s, t = (Fraction(x, sum(shares)) for x in shares)
    result = convert_to_patches(surface, Split(at=(float(r), float(s), float(t))))
    assert len(result.triangles) == 3
    assert len(result.patches) == 0
    n = max(degree, 2)  # all nets get the same degree, and the colours have degree 2
    assert result.triangle_degree == n
    # Three triangles share three inner edges of n + 1 points, all of which have one common end.
    vertex_count = 3 * count_points(n) - 3 * (n + 1) + 1
    assert len(result.vertices) == vertex_count, "the triangles share the vertices of their edges"
    for corner in range(3):
        for place in PLACES:
            # Part number `corner` has the point of the split, (r, s, t), in place of this corner.
            old_place = [x * place[corner] for x in (r, s, t)]
            for m in range(3):
                old_place[m] += place[m] if m != corner else 0
            assert_near(
                evaluate_indexed_triangle(result, corner, place),
                evaluate_triangle(surface, tuple(old_place)),
            )


@pytest.mark.parametrize(
    ("operation", "exchanged"),
    [(Transpose(), (1, 2)), (Reverse("u"), (0, 1)), (Reverse("v"), (0, 2))],
)
def test_transposed_and_reversed_triangles_have_the_same_points(
    operation: Operation, exchanged: tuple[int, int]
) -> None:
    surface = random_triangle(3, 1, True)
    result = convert_to_triangle(surface, operation)
    for place in PLACES:
        a, b = exchanged
        new_place = list(place)
        new_place[a], new_place[b] = place[b], place[a]
        assert evaluate_triangle(result, tuple(new_place)) == evaluate_triangle(surface, place)
    restored = convert_to_triangle(result, operation)
    np.testing.assert_array_equal(restored.control_net, surface.control_net)
    np.testing.assert_array_equal(restored.weights, surface.weights)


@settings(max_examples=6)
@given(st.tuples(degrees, degrees), seeds, st.booleans(), st.sampled_from(["lower", "upper"]))
def test_half_of_a_patch_has_its_points(
    degree: tuple[int, int], seed: int, is_rational: bool, half: Half
) -> None:
    surface = random_bezier(degree, seed, is_rational)
    result = convert_to_triangle(surface, ToTriangle(half))
    assert result.degree == sum(degree)
    evaluate = build_bezier_evaluator(surface)
    for r, s, t in PLACES:
        u, v = (s, t) if half == "lower" else (1 - s, 1 - t)
        assert_near(evaluate_triangle(result, (r, s, t)), evaluate(u, v))


@pytest.mark.parametrize("is_rational", [False, True])
def test_operations_on_patches_and_triangles_keep_points_and_the_shared_edge(
    is_rational: bool,
) -> None:
    surface = build_mixed_patches(1, is_rational)
    old_report = build_mesh(surface.lower(), resolution=(3, 3)).report
    for operation in (Elevate((5, 5)), Transpose(), Reverse("u"), Reverse("v"), ToBezier()):
        result = convert_to_patches(surface, operation)
        assert result.parts == surface.parts
        report = build_mesh(result.lower(), resolution=(3, 3)).report
        assert report.boundary_edges == old_report.boundary_edges
        assert report.vertices == old_report.vertices
    result = convert_to_patches(surface, Elevate((5, 5)))
    assert (result.degree, result.triangle_degree) == ((5, 5), 5)
    assert len(result.vertices) == 36 + 21 - 6, (
        "patch and triangle share the vertices of their edge"
    )
    assert_same(build_patch_evaluator(result, 0), build_patch_evaluator(surface, 0))
    for place in PLACES:
        assert_near(
            evaluate_indexed_triangle(result, 0, place),
            evaluate_indexed_triangle(surface, 0, place),
        )
        r, s, t = place
        for operation, new_place in (
            (Transpose(), (r, t, s)), (Reverse("u"), (s, r, t)), (Reverse("v"), (t, s, r)),
        ):  # fmt: skip
            changed = convert_to_patches(surface, operation)
            assert evaluate_indexed_triangle(changed, 0, new_place) == evaluate_indexed_triangle(
                surface, 0, place
            )


@pytest.mark.parametrize(
    ("operation", "code", "pointer"),
    [
        (Elevate((2, 2)), "degree_too_low", "/degree"),
        (Elevate((4, 5)), "wrong_value", "/degree"),
        (Split(u=0.5), "missing_field", "/at"),
        (Restrict(u=(0, 0.5)), "unsupported_operation", ""),
        (ToTriangle("lower"), "unsupported_operation", ""),
    ],
)
def test_refused_operations_on_a_triangle(operation: Operation, code: str, pointer: str) -> None:
    with pytest.raises(SurfaceError) as caught:
        convert(random_triangle(3, 1, False), [Transpose(), operation])
    (issue,) = caught.value.issues
    assert (issue.code, issue.pointer) == (code, f"/operations/1{pointer}")
    assert issue.got
    assert issue.needed


@pytest.mark.parametrize(
    ("operation", "code", "pointer"),
    [
        (Elevate((4, 5)), "wrong_value", "/degree"),
        (Split(u=0.5), "several_patches", ""),
        (Split(at=(0.5, 0.25, 0.25)), "several_patches", ""),
        (Restrict(u=(0, 0.5)), "several_patches", ""),
        (ToTriangle("upper"), "several_patches", ""),
    ],
)
def test_refused_operations_on_patches_and_triangles(
    operation: Operation, code: str, pointer: str
) -> None:
    with pytest.raises(SurfaceError) as caught:
        convert(build_mixed_patches(1, False), [operation])
    (issue,) = caught.value.issues
    assert (issue.code, issue.pointer) == (code, f"/operations/0{pointer}")


def test_too_large_results_are_refused_before_they_are_built() -> None:
    surface = random_triangle(3, 1, False)
    for operation in (Elevate((9, 9)), Split(at=(0.5, 0.25, 0.25))):  # 55 points, and 3 · 10
        with pytest.raises(SurfaceError) as caught:
            convert(surface, [operation], SizeLimits(29))
        assert caught.value.issues[0].code == "too_many_control_points"
    large = BezierSurface(np.random.default_rng(1).uniform(-1, 1, (40, 40, 3)))
    with pytest.raises(SurfaceError) as caught:
        convert(large, [ToTriangle("lower")])
    assert caught.value.issues[0].code == "degree_too_high"
    with pytest.raises(SurfaceError) as caught:
        # 36 points of the patch and 21 of the triangle.
        convert(build_mixed_patches(1, False), [Elevate((5, 5))], SizeLimits(56))
    assert caught.value.issues[0].code == "too_many_control_points"
