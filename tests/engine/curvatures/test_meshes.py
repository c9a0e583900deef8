"""Curvatures of meshes, compared with formulas and with curvatures at single parameters."""

import numpy as np
import pytest

from service.engine.accuracy import Accuracy
from service.engine.connectivity.connect import connect
from service.engine.curvatures import rows
from service.engine.curvatures.rows import find_parameters, layout_curvatures
from service.engine.mesh.mesh import CURVATURE_NAMES, Mesh
from service.engine.options import MeshOptions
from service.engine.plans.layout import Layout
from service.engine.points.evaluate import evaluate_points
from service.engine.points.jets import evaluate_jets
from service.engine.points.places import PointsQuery, locate
from service.errors import TooLarge
from service.surface.batches import TensorPatches
from service.surface.bezier import BezierSurface, TriangleSurface
from service.surface.bspline import BsplineSurface
from service.surface.examples import quadrics
from service.surface.lowered import Part, PatchModel
from tests.strategies import Array
from tools.building import build
from tools.certify.surfaces import FAMILIES
from tools.examples import lower_patches

FINE = Accuracy(tolerance=0.02)


def build_mesh(model: PatchModel, resolution: tuple[int, int] = (5, 4), **fields: object) -> Mesh:
    """The mesh of a model, with curvatures; `fields` are other options."""
    options = MeshOptions(resolution=resolution, curvatures=True, **fields)  # type: ignore[arg-type]
    return build(model, options)


def read_curvatures(mesh: Mesh) -> tuple[Array, Array]:
    """Gaussian and mean curvature of the vertices."""
    result = dict(mesh.attributes)
    gaussian, mean = (result[name] for name in CURVATURE_NAMES)
    assert gaussian.shape == mean.shape == (len(mesh.positions), 1)
    return gaussian[:, 0].astype(np.float64), mean[:, 0].astype(np.float64)


def check_curvatures(mesh: Mesh, gaussian: Array, mean: Array, limit: float = 1e-10) -> None:
    """Compares K and H of all vertices, within a limit relative to the largest curvature."""
    scale = max(1e-300, float(np.abs(mean).max()), float(np.abs(gaussian).max()) ** 0.5)
    result = read_curvatures(mesh)
    np.testing.assert_allclose(result[0], gaussian, rtol=limit, atol=limit * scale**2)
    np.testing.assert_allclose(result[1], mean, rtol=limit, atol=limit * scale)


@pytest.mark.parametrize("radius", [1.0, 3.0, 1e-9, 1e12])
@pytest.mark.parametrize("accuracy", [None, Accuracy(relative_tolerance=0.01)])
def test_a_sphere_has_constant_curvatures_and_one_vertex_per_position(
    radius: float, accuracy: Accuracy | None
) -> None:
    """K = 1/r² and H = −1/r, also at the poles, where sides of patches are one point."""
    model = quadrics.sphere(radius).lower()
    mesh = build_mesh(model, (6, 5), accuracy=accuracy)
    ones = np.ones(len(mesh.positions))
    check_curvatures(mesh, ones / radius**2, -ones / radius, 1e-11)
    assert len(mesh.positions) == mesh.report.vertices
    assert mesh.report.watertight
    assert mesh.report.curvature is not None
    _, (low, high) = mesh.report.curvature  # the ranges of K and of H
    assert low == pytest.approx(-1 / radius) == high


@pytest.mark.parametrize("accuracy", [None, FINE])
def test_the_curvatures_at_the_apex_of_a_cone_are_0(accuracy: Accuracy | None) -> None:
    """H = −cos α / (2ρ) is unbounded near the apex, so it has no limit; the mesh has 0 there.

    ρ is the distance from the axis, and α the angle between axis and side: here tan α = ½.
    """
    mesh = build_mesh(quadrics.cone(1.0, 2.0).lower(), accuracy=accuracy)
    assert mesh.normals is not None
    rho = np.hypot(*mesh.positions[:, :2].T)
    is_on_side = mesh.normals[:, 2] > 0  # not on the base, whose normals point down
    is_apex = is_on_side & (rho < 1e-12)
    assert is_apex.any()
    is_curved = is_on_side & ~is_apex
    mean = np.zeros(len(rho))
    mean[is_curved] = -1 / np.sqrt(5) / rho[is_curved]
    check_curvatures(mesh, np.zeros(len(rho)), mean, 1e-9)


def random_net(*shape: int) -> Array:
    """A net of this shape with random control points."""
    return np.random.default_rng(sum(shape)).normal(size=(*shape, 3))


def build_triangle(degree: int) -> Array:
    """A triangular net with random control points."""
    count = (degree + 1) * (degree + 2) // 2
    net: Array = np.random.default_rng(degree).normal(size=(count, 3))
    return net


WEIGHTS = np.random.default_rng(5).uniform(0.3, 3, size=(4, 5))
SURFACES: dict[str, BezierSurface | TriangleSurface | BsplineSurface] = {
    "bilinear": BezierSurface(random_net(2, 2)),
    "bicubic": BezierSurface(random_net(4, 4)),
    "rational": BezierSurface(random_net(4, 5), WEIGHTS),
    "long and far": BezierSurface(random_net(3, 6) * [1e5, 1, 1e-2] + 1e6),
    "high degree": BezierSurface(random_net(14, 21)),
    "rational of high degree": BezierSurface(random_net(24, 3), np.ones((24, 3)) + np.eye(24, 3)),
    "flat triangle": TriangleSurface(build_triangle(1)),
    "quadratic triangle": TriangleSurface(build_triangle(2)),
    "rational triangle": TriangleSurface(build_triangle(4), np.linspace(0.5, 2, 15)),
    "triangle of high degree": TriangleSurface(build_triangle(17)),
    "spline": BsplineSurface(random_net(6, 5), (2, 3)),
    "rational spline": BsplineSurface(
        random_net(5, 6), (3, 2), weights=np.random.default_rng(7).uniform(0.5, 2, (5, 6))
    ),
}


@pytest.mark.parametrize("name", SURFACES)
@pytest.mark.parametrize("resolution", [(1, 1), (33, 12)])
def test_meshes_agree_with_single_parameters(name: str, resolution: tuple[int, int]) -> None:
    model = SURFACES[name].lower()
    compare_with_single_parameters(model, build_mesh(model, resolution, weld=False, uvs=True))


@pytest.mark.parametrize("name", SURFACES)
def test_meshes_by_tolerance_agree_with_single_parameters(name: str) -> None:
    model = SURFACES[name].lower()
    accuracy = Accuracy(relative_tolerance=0.1 if "high" in name else 0.02)
    compare_with_single_parameters(
        model, build_mesh(model, weld=False, uvs=True, accuracy=accuracy)
    )


def compare_with_single_parameters(model: PatchModel, mesh: Mesh) -> None:
    """Compares each vertex with the point at its parameters; at knots, with one-sided limits.

    At a knot the curvatures may jump. There a vertex must have the curvatures of one side: at its
    parameters, or 1e-11 below them.
    """
    assert mesh.uvs is not None
    result = np.stack(read_curvatures(mesh))
    differences = []
    steps = (0.0, 1e-11) if model.domain is not None else (0.0,)
    for du in steps:
        for dv in steps:
            uvs: Array = np.clip(mesh.uvs - np.array([du, dv]), 0, None)
            if isinstance(model.batches[0], TensorPatches):
                query = PointsQuery(uvs, None, order=2)
            else:
                places = np.column_stack([1 - uvs.sum(axis=1), uvs])
                query = PointsQuery(places, None, order=2)
            columns = evaluate_points(model, locate(model, query), 2)
            expected = np.array([columns[name] for name in CURVATURE_NAMES], np.float64)
            largest_curvature: Array = np.abs(
                columns["principal_curvatures"].astype(np.float64)
            ).max(axis=1)
            largest_curvature = np.maximum(largest_curvature, 1e-9)
            differences.append(
                np.abs(result - expected) / np.stack([largest_curvature**2, largest_curvature])
            )
    assert np.min(differences, axis=0).max() < 2e-7


@pytest.mark.parametrize("name", FAMILIES)
def test_curvatures_of_all_families_agree_with_single_parameters(name: str) -> None:
    """The families have cusps, folds, poles, extreme weights, and sizes from 1e-6 to 1e6."""
    model = FAMILIES[name].surface(1).lower()
    # Curvatures below a tenth of 1/diagonal are compared as if they were this large.
    min_scale = 0.1 / float(np.linalg.norm(model.bounds[1] - model.bounds[0]))
    layout = Layout.plan(connect(model).connectivity, (5, 4))
    curvatures = np.stack([c.values[:, 0] for c in layout_curvatures(model, layout, np.float64)])
    for block in layout.blocks:
        # For each vertex of the block: the row of its patch, and the number of its sample there.
        patch, sample = np.divmod(np.arange(block.count * len(block.patches)), block.count)
        places = block.patches[patch], *find_parameters(block, sample)
        batch = model.batches[block.batch]
        expected = evaluate_jets(batch, *places, 2).curvatures
        assert expected is not None
        result = curvatures[:, block.base : block.base + len(patch)]
        _, mean = result
        is_defined = ~np.isnan(expected[1])
        assert not mean[~is_defined].any()
        scale = np.maximum(np.abs(expected[2]), np.abs(expected[3]))[is_defined]
        scale = scale.clip(min_scale)
        differences = np.abs(result - expected[:2])[:, is_defined]
        assert (differences / np.stack([scale**2, scale])).max(initial=0.0) < 1e-8


def test_samples_of_framed_sides_have_the_curvatures_of_their_patch() -> None:
    """A curved patch and a flat patch meet; the flat patch is stitched along the common edge.

    The edge is along v of the curved patch, and along u of the flat patch. It has the 7 divisions
    of v, and the flat patch has only 3 divisions along u.
    """
    curved = np.array([[[0, 0, 0], [1, 0, 0]], [[0, 1, 0], [1, 1, 1]]], dtype=float)
    flat = np.array([[[0, 0, 0], [0, -1, 0]], [[1, 0, 0], [1, -1, 0]]], dtype=float)
    patches = TensorPatches(np.stack([curved, flat]))
    model = PatchModel("frame", (patches,), (Part("frame", 0, 2),))
    assert Layout.plan(connect(model).connectivity, (3, 7)).is_stitched
    mesh = build_mesh(model, (3, 7), weld=False)
    x, y, _ = mesh.positions.T
    gaussian, mean = read_curvatures(mesh)
    # The curved patch is z = x y over y ≥ 0, with K = −1/(1 + x² + y²)²; the flat patch is y ≤ 0.
    expected = -1 / (1 + x * x + y * y) ** 2
    is_on_curved, is_on_flat = y > 1e-9, y < -1e-9
    np.testing.assert_allclose(gaussian[is_on_curved], expected[is_on_curved], rtol=1e-12)
    np.testing.assert_allclose(gaussian[is_on_flat], 0, atol=1e-14)
    # On the seam, some samples belong to the curved patch and the others to the flat patch.
    is_on_seam = np.abs(y) < 1e-9
    has_curvature = np.abs(gaussian - expected) < 1e-12
    assert is_on_seam.sum() > 8
    assert (has_curvature | (np.abs(gaussian) < 1e-14))[is_on_seam].all()
    assert has_curvature[is_on_seam].any()
    assert not has_curvature[is_on_seam].all()
    assert np.abs(mean[is_on_flat]).max() < 1e-14


def test_a_seam_with_a_jump_of_curvature_stays_closed_and_smooth() -> None:
    """At knots of a quadratic spline, two vertices have equal positions and normals."""
    surface = BsplineSurface(random_net(6, 6), (2, 2))
    plain = build(surface.lower(), MeshOptions(resolution=(4, 4)))
    mesh = build_mesh(surface.lower(), (4, 4))
    assert mesh.welds is not None
    assert mesh.normals is not None
    assert len(mesh.positions) > len(plain.positions) == mesh.report.vertices
    assert mesh.report.boundary_edges == plain.report.boundary_edges
    np.testing.assert_array_equal(mesh.positions, mesh.positions[mesh.welds])
    np.testing.assert_array_equal(mesh.normals, mesh.normals[mesh.welds])
    corners = mesh.positions[mesh.triangles].tobytes()
    assert corners == plain.positions[plain.triangles].tobytes()
    gaussian, mean = read_curvatures(mesh)
    repeated = np.flatnonzero(mesh.welds != np.arange(len(mesh.welds)))
    jump = np.abs(mean[repeated] - mean[mesh.welds[repeated]])
    assert (jump > 1e-6 * np.abs(mean[repeated])).mean() > 0.9
    assert np.isfinite(gaussian).all()


def test_curvatures_do_not_change_positions_normals_and_faces() -> None:
    """Meshes with and without curvatures have equal positions, normals and faces, bit for bit."""
    for name in ("sphere", "torus", "bspline-hills"):
        options = MeshOptions(resolution=(4, 4))
        plain = build(lower_patches(name), options)
        mesh = build_mesh(lower_patches(name), (4, 4))
        for key in ("positions", "normals", "triangles"):
            assert getattr(plain, key).tobytes() == getattr(mesh, key).tobytes()
        assert plain.report.curvature is None


@pytest.mark.parametrize("size", [1e-25, 1e25])
def test_curvatures_beyond_float32_become_its_largest_number_or_0(size: float) -> None:
    mesh = build(
        quadrics.sphere(size).lower(),
        MeshOptions(resolution=(2, 2), curvatures=True),
        is_float32=True,
    )
    gaussian, mean = read_curvatures(mesh)
    assert gaussian.max() == gaussian.min() == (np.finfo(np.float32).max if size < 1 else 0)
    np.testing.assert_allclose(mean, -1 / size, rtol=1e-6)


def test_too_many_limits_of_curvatures_at_poles_are_refused(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The eight patches of a sphere have a pole each; with 6 divisions a pole has 7 samples.

    As many limits as these, 8 · 7, are allowed.
    """
    model = quadrics.sphere().lower()
    monkeypatch.setattr(
        rows,
        "MAX_MULTIPLICATIONS",
        rows.count_limit_multiplications(model.batches[0]) * 8 * 7,
    )
    assert len(read_curvatures(build_mesh(model, (6, 6)))[0]) > 0
    with pytest.raises(TooLarge) as refused:
        build_mesh(model, (7, 7))
    (issue,) = refused.value.issues
    assert (issue.code, issue.pointer) == ("too_costly", "/curvatures")


@pytest.mark.parametrize("wires", ["tubes", "ribbons"])
def test_the_curvatures_of_wires_are_0(wires: str) -> None:
    mesh = build_mesh(quadrics.sphere().lower(), isocurves=(1, 1), wires=wires)
    surface, wire = mesh.parts
    gaussian, mean = read_curvatures(mesh)
    of_surface = np.unique(mesh.triangles[slice(*surface.triangles)])
    of_wires = np.unique(mesh.triangles[slice(*wire.triangles)])
    np.testing.assert_allclose(gaussian[of_surface], 1, rtol=1e-11)
    assert not gaussian[of_wires].any()
    assert not mean[of_wires].any()
    assert mesh.report.curvature is not None
    np.testing.assert_allclose(mesh.report.curvature, [(1, 1), (-1, -1)], rtol=1e-11)
