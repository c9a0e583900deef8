"""Regular triangulations become the meshes that a resolution gives."""

from dataclasses import replace
from math import acos

import numpy as np
import pytest
from scipy.spatial import cKDTree

from service.bases.arrays import RealArray
from service.engine.accuracy import Accuracy
from service.engine.adaptive.assemble import assemble, draw_overlays
from service.engine.adaptive.samples import find_samples
from service.engine.bounds.faces import SPAN
from service.engine.connectivity.closure import find_closure
from service.engine.connectivity.connect import connect
from service.engine.mesh.mesh import Mesh
from service.engine.options import MeshOptions
from service.engine.stored_positions import Storage
from service.surface.batches import TrianglePatches
from service.surface.bezier import BezierSurface
from service.surface.bspline import BsplineSurface
from service.surface.lowered import PatchModel
from tests.engine.adaptive.grids import build_regular
from tests.engine.meshing import build_mesh, check_sound, find_topology
from tests.strategies import Array
from tools.examples import lower_patches

EXAMPLES = [
    "utah-teapot", "tveit", "bourke-1111-colors", "heated-panel", "cylinder", "sphere", "torus",
    "octahedral-sphere", "rounded-box", "bspline-hills", "nurbs-goblet", "bspline-ring",
]  # fmt: skip


def assemble_regular(
    source: str | PatchModel, divisions: int = 2, storage: Storage | None = None, **options: object
) -> Mesh:
    """A regular mesh, assembled as adaptive meshes are."""
    model = lower_patches(source) if isinstance(source, str) else source
    mesh_options, storage = MeshOptions(**options), storage or Storage()  # type: ignore[arg-type]
    built = build_regular(model, divisions)
    origin = storage.choose_origin(*model.bounds)
    lines = draw_overlays(model, built.border, mesh_options, storage, origin)
    return assemble(
        *(model, built.faces, built.triangulation, mesh_options, lines),
        storage=storage,
        origin=origin,
        closure=find_closure(model, connect(model).connectivity),
    )


def list_corners(mesh: Mesh, values: RealArray) -> tuple[Array, Array]:
    """For each corner of each triangle a point that identifies it, and its values."""
    ends: Array = mesh.positions[mesh.triangles].astype(np.float64)
    inside = 0.9 * ends + 0.1 * ends.mean(axis=1, keepdims=True)
    corner_values: Array = values[mesh.triangles].astype(np.float64)
    return inside.reshape(-1, 3), corner_values.reshape(len(inside) * 3, -1)


def check_same_corners(mesh: Mesh, other: Mesh, limit: float) -> int:
    """Checks that values at the corners of common triangles differ by at most `limit`.

    Returns the number of these corners. At poles, the two meshes use different samples as corners
    of triangles, so not all triangles are common.
    """
    pairs = [(mesh.normals, other.normals), (mesh.uvs, other.uvs), (mesh.colors, other.colors)]
    pairs += [(values, dict(other.attributes)[name]) for name, values in mesh.attributes]
    compared = 0
    for ours, theirs in pairs:
        assert (ours is None) == (theirs is None)
        if ours is None or theirs is None:
            continue
        points, values = list_corners(mesh, ours)
        other_points, expected = list_corners(other, theirs)
        distance, row = cKDTree(other_points).query(points)
        same = distance < 1e-9 * max(1.0, float(np.abs(other_points).max()))
        np.testing.assert_allclose(values[same], expected[row[same]], atol=limit)
        compared = int(same.sum())
    return compared


@pytest.mark.parametrize("example", EXAMPLES)
def test_a_regular_triangulation_is_the_mesh_of_a_resolution(example: str) -> None:
    ours = assemble_regular(example, uvs=True)
    theirs = build_mesh(example, resolution=(2, 2), uvs=True)
    check_sound(ours)
    batches = lower_patches(example).batches
    # `ours` has triangular patches divided as squares of which side v = 1 is one point: there, no
    # triangles need be common.
    triangular = [isinstance(batch, TrianglePatches) for batch in batches]
    if not all(triangular):
        compared = check_same_corners(ours, theirs, 1e-9)
        has_poles = any(triangular) or any(bool(batch.collapsed.any()) for batch in batches)
        are_all_common = compared == 3 * len(theirs.triangles) == 3 * len(ours.triangles)
        assert are_all_common or (has_poles and compared > 100)
    assert find_topology(ours).boundary == find_topology(theirs).boundary
    assert ours.report.watertight == theirs.report.watertight
    assert ours.report.closure == theirs.report.closure
    np.testing.assert_allclose(ours.report.bounds_max, theirs.report.bounds_max, atol=1e-12)


def build_roof(degree: int = 2) -> PatchModel:
    """A roof over [0, 2] × [0, 1] with its ridge at u = 1, a knot of full multiplicity."""
    u = np.arange(2 * degree + 1) / degree
    net = np.stack(
        np.broadcast_arrays(u[:, None], np.array([0.0, 1.0]), 1 - np.abs(u - 1)[:, None]), axis=-1
    )
    ends = [0.0] * (degree + 1), [2.0] * (degree + 1)
    knots = [*ends[0], *([1.0] * degree), *ends[1]]
    surface = BsplineSurface(net, (degree, 1), (np.array(knots), np.array([0.0, 0, 1, 1])))
    model = surface.lower()
    assert isinstance(model, PatchModel)
    return model


def test_a_crease_at_a_knot_line_has_a_normal_on_each_side() -> None:
    mesh = assemble_regular(build_roof())
    assert mesh.normals is not None
    assert mesh.welds is not None
    slope = np.sqrt(0.5)
    for triangle in mesh.triangles:
        left = mesh.positions[triangle, 0].mean() < 1
        expected = np.array([-slope if left else slope, 0, slope])
        np.testing.assert_allclose(mesh.normals[triangle], [expected] * 3, atol=1e-12)
    on_ridge = mesh.positions[:, 0] == 1
    # The ridge has three positions, with two vertices each; the border has 2 (4 + 2) edges.
    assert np.count_nonzero(on_ridge) == 2 * 3
    assert mesh.report.vertices == len(mesh.positions) - 3
    assert mesh.report.boundary_edges == 12
    check_sound(mesh)


@pytest.mark.parametrize("per_face", [False, True])
def test_a_corner_belongs_to_the_patch_that_the_triangle_covers(per_face: bool) -> None:
    """A step from the corner towards the middle of the triangle stays in the patch."""
    model = lower_patches("bspline-hills")
    built = build_regular(model, 3, per_face=per_face)
    # The patch of each sample and its place there, and the corners of triangles as sample numbers.
    samples, _, corners = find_samples(built.faces, built.triangulation)
    assert model.domain is not None
    columns = len(model.domain.v) - 1
    # For each corner: the span (row and column) of its patch, and its parameters in this span.
    span = np.stack(np.divmod(samples.patch, columns), axis=1)[corners]
    corner_places = np.stack([samples.u, samples.v], axis=1)[corners]
    assert corner_places.min() == 0
    assert corner_places.max() == 1
    places = span + corner_places
    expected = (
        np.stack([built.triangulation.u, built.triangulation.v], axis=1)[
            built.triangulation.triangles
        ]
        / SPAN
    )
    np.testing.assert_allclose(places, expected, atol=1e-9)
    middle = places.mean(axis=1, keepdims=True)
    ahead = places + 1e-3 * (middle - places) - span
    assert ahead.min() >= -1e-9
    assert ahead.max() <= 1 + 1e-9
    np.testing.assert_array_equal(
        samples.vertex[corners], built.triangulation.vertex[built.triangulation.triangles]
    )


def test_parts_are_runs_with_bounds_of_their_own() -> None:
    model = lower_patches("utah-teapot")
    built = build_regular(model, 2)
    mesh = assemble_regular(model)
    # Each face of the teapot is one patch.
    patch = built.triangulation.face[built.triangulation.triangles[:, 0]]
    sequence = np.arange(model.patch_count) if model.sequence is None else model.sequence
    result = []
    for part, mesh_part in zip(model.parts, mesh.parts, strict=True):
        inside = np.isin(patch, sequence[part.first : part.last])
        first, last = mesh_part.triangles
        assert last - first == np.count_nonzero(inside)
        assert mesh_part.deviation_bound == built.triangulation.bounds[inside].max()
        corners = built.triangulation.positions[
            built.triangulation.vertex[built.triangulation.triangles[inside]]
        ]
        ours = mesh.positions[mesh.triangles[first:last]]
        # The triangles are compared in the order of their middles.
        order, our_order = (np.lexsort(c.mean(axis=1).round(9).T) for c in (corners, ours))
        np.testing.assert_array_equal(corners[order], ours[our_order])
        result.append(float(built.triangulation.bounds[inside].max()))
    assert mesh.report.deviation_bound == max(result)
    assert len(model.parts) > 1


def test_patches_are_written_in_the_order_of_the_sequence() -> None:
    """The batches have the patch of tveit first, the sequence has the flat patch first."""
    model = lower_patches("tveit")
    flat = BezierSurface(np.array([[[9.0, 0, 0], [9, 1, 0]], [[10, 0, 0], [10, 1, 0]]])).lower()
    assert isinstance(flat, PatchModel)
    both = replace(
        model,
        batches=(*model.batches, *flat.batches),
        domains=(),
        sequence=np.array([1, 0]),
        parts=(replace(model.parts[0], name="flat", first=0, last=1),
               replace(model.parts[0], name="tveit", first=1, last=2)),
    )  # fmt: skip
    mesh = assemble_regular(both)
    flat_part, tveit_part = mesh.parts
    assert mesh.positions[mesh.triangles[slice(*flat_part.triangles)], 0].min() == 9
    assert mesh.positions[mesh.triangles[slice(*tveit_part.triangles)], 0].max() < 9


def test_the_largest_angle_is_measured_if_requested() -> None:
    """It is the angle of normals at two corners of a triangle; the mesh may be without normals."""
    accuracy = Accuracy(angle_tolerance=0.5)
    mesh = assemble_regular("saddle", 3, accuracy=accuracy)
    assert mesh.normals is not None
    result = 0.0
    for triangle in mesh.triangles:
        a, b, c = mesh.normals[triangle]
        for one, other in ((a, b), (b, c), (c, a)):
            result = max(result, acos(min(1.0, float(one @ other))))
    assert mesh.report.normal_angle == pytest.approx(result, abs=1e-7)
    bare = assemble_regular("saddle", 3, accuracy=accuracy, normals=False)
    assert bare.normals is None
    assert bare.report.normal_angle == mesh.report.normal_angle
    assert assemble_regular("saddle", 3).report.normal_angle is None


def test_the_boundary_overlay_is_the_open_edges_of_the_mesh() -> None:
    mesh = assemble_regular("saddle", 4, overlays=("control_net", "boundary"))
    net, border = mesh.overlays
    assert net.name == "control_net"
    ends = border.positions[border.segments]
    distance, rows = cKDTree(mesh.positions).query(ends.reshape(-1, 3))
    assert distance.max() == 0
    drawn = {frozenset(pair) for pair in rows.reshape(-1, 2).tolist()}
    counts: dict[frozenset[int], int] = {}
    for a, b, c in mesh.triangles.tolist():
        for pair in (frozenset((a, b)), frozenset((b, c)), frozenset((c, a))):
            counts[pair] = counts.get(pair, 0) + 1
    assert drawn == {pair for pair, count in counts.items() if count == 1}
    assert len(drawn) == len(border.segments) == 16
