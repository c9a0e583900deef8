"""Colours, texture coordinates and attributes: exact at every sample, equal where patches meet."""

from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from oracles import exact
from oracles.triangles import places as triangle_places
from oracles.triangles import to_exact_triangle, value
from service.bases import triangle
from service.bases.arrays import RealArray
from service.engine.mesh.channels import ChannelRows, match_values
from service.engine.mesh.mesh import Mesh
from service.surface.batches import Channel, TensorPatches
from service.surface.bezier import BezierSurface, TriangleSurface
from service.surface.channels import Channels
from service.surface.lowered import Part, PatchModel
from service.surface.patches import PatchSurface
from tests.engine.meshing import build_mesh, check_sound, find_topology
from tests.strategies import (
    ROTATIONS,
    Array,
    apply_symmetry,
    build_model,
    nets,
    resolutions,
    split_quarters,
    translate,
    weights_like,
)

SQUARE = np.array([[[0.0, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 0]]])


@st.composite
def values(draw: st.DrawFn, dimension: int, low: float = -100.0, high: float = 100.0) -> Array:
    """A net of values, of degrees from 0 to 6."""
    shape = (draw(st.integers(1, 7)), draw(st.integers(1, 7)), dimension)
    return draw(arrays.arrays(np.float64, shape, elements=st.floats(low, high)))


def evaluate_exactly(net: Array, resolution: tuple[int, int]) -> Array:
    """The exact values at the samples, (Ru+1)(Rv+1) rows, each number rounded once."""
    fractions = exact.to_exact_net(net)
    return np.array(
        [
            [float(x) for x in exact.surface_point(fractions, u, v)]
            for u in exact.list_parameters(resolution[0])
            for v in exact.list_parameters(resolution[1])
        ]
    )


def find_attribute(mesh: Mesh, name: str) -> RealArray:
    """The values (V, d) of an attribute."""
    (result,) = (rows for title, rows in mesh.attributes if title == name)
    return result


def check_close(result: Any, expected: Any, net: Array, is_float32: bool = False) -> None:
    """Checks that values are equal up to the precision of the mesh, relative to the net."""
    size = max(1.0, float(np.abs(net).max()))
    np.testing.assert_allclose(
        result, expected, rtol=0, atol=(1e-7 if is_float32 else 4e-15) * size
    )


@given(st.data(), nets(), resolutions, st.booleans())
def test_every_channel_is_its_own_polynomial(
    data: st.DataObject, net: Array, resolution: tuple[int, int], is_float32: bool
) -> None:
    """Its degree may differ from that of the surface, whose weights do not affect the channel."""
    weights = data.draw(st.none() | weights_like(net))
    colors = data.draw(values(data.draw(st.sampled_from([3, 4])), 0.0, 1.0))
    uvs, flow = data.draw(values(2)), data.draw(values(data.draw(st.integers(1, 6))))
    surface = BezierSurface(net, weights, channels=Channels(colors, uvs, (("flow", flow),)))
    mesh = build_mesh(surface.lower(), resolution=resolution, weld=False, is_float32=is_float32)
    assert mesh.colors is not None
    assert mesh.uvs is not None
    assert mesh.colors.dtype == mesh.uvs.dtype == mesh.positions.dtype
    check_close(mesh.colors, evaluate_exactly(colors, resolution), colors, is_float32)
    check_close(mesh.uvs, evaluate_exactly(uvs, resolution), uvs, is_float32)
    check_close(find_attribute(mesh, "flow"), evaluate_exactly(flow, resolution), flow, is_float32)
    assert mesh.colors.min() >= 0
    assert mesh.colors.max() <= 1


def test_corner_samples_have_the_control_values() -> None:
    """They are equal bit for bit."""
    net = np.random.default_rng(1).random((4, 3, 2))
    surface = BezierSurface(SQUARE, channels=Channels(attributes=(("a", net),)))
    rows = find_attribute(build_mesh(surface.lower(), resolution=(7, 5)), "a")
    np.testing.assert_array_equal(rows[[0, 5, -6, -1]], net[[0, 0, -1, -1], [0, -1, 0, -1]])


def build_attribute_model(pieces: list[Array], values_of_patches: list[Array]) -> PatchModel:
    """A model of patches of one degree; `values_of_patches` are the nets of their attribute "a"."""
    points = np.stack(pieces) + 0.0  # −0.0 becomes 0.0
    channel = Channel("a", "attribute", np.stack(values_of_patches))
    batch = TensorPatches(points, channels=(channel,))
    return PatchModel("model", (batch,), (Part("model", 0, len(pieces)),))


@given(st.data(), resolutions)
def test_framed_patches_have_the_values_of_their_neighbours(
    data: st.DataObject, resolution: tuple[int, int]
) -> None:
    """Quarters of a surface with different parametrizations weld.

    Some of them are stitched: strips connect their inner grid to sides with more divisions.
    """
    net, channel_net = np.empty((3, 3, 3)), np.empty((4, 4, 2))
    net[..., 0], net[..., 1] = np.meshgrid(np.arange(3.0), np.arange(3.0), indexing="ij")
    net[..., 2] = data.draw(arrays.arrays(np.float64, (3, 3), elements=st.integers(-4, 4)))
    channel_net[:] = data.draw(arrays.arrays(np.float64, (4, 4, 2), elements=st.integers(-64, 64)))
    symmetries = data.draw(st.lists(st.sampled_from(ROTATIONS), min_size=4, max_size=4))
    patches = [
        apply_symmetry(piece, s) for piece, s in zip(split_quarters(net), symmetries, strict=True)
    ]
    channel_nets = [
        apply_symmetry(piece, s)
        for piece, s in zip(split_quarters(channel_net), symmetries, strict=True)
    ]
    mesh = build_mesh(build_attribute_model(patches, channel_nets), resolution=resolution)
    check_sound(mesh)
    assert find_topology(mesh).boundary == mesh.report.boundary_edges
    plain = build_mesh(build_model(patches), resolution=resolution)
    assert len(mesh.positions) == len(plain.positions)
    assert mesh.welds is None
    # x = 2 u and y = 2 v over the whole surface, so the parameters follow from the vertex.
    for position, row in zip(mesh.positions, find_attribute(mesh, "a"), strict=True):
        u, v = (Fraction(float(c)).limit_denominator(10**6) / 2 for c in position[:2])
        expected = exact.surface_point(exact.to_exact_net(channel_net), u, v)
        np.testing.assert_allclose(row, [float(x) for x in expected], atol=1e-10)


def build_strip(left: Array, right: Array) -> PatchModel:
    """Two flat patches side by side; the arguments are the nets of their attribute."""
    return build_attribute_model([SQUARE, translate(SQUARE, 1.0)], [left, right])


@pytest.mark.parametrize("normals", [True, False])
def test_samples_weld_only_if_their_values_are_equal(normals: bool) -> None:
    """One of the five samples of each patch on the seam has the value of the other patch."""
    left = np.array([[[0.0], [0]], [[5], [5]]])
    right = np.array([[[5.0], [9]], [[0], [0]]])
    mesh = build_mesh(build_strip(left, right), resolution=(4, 4), normals=normals)
    # The values agree at v = 0 only.
    assert len(mesh.positions) == 2 * 25 - 1
    assert mesh.report.vertices == 2 * 25 - 5  # the report counts positions
    # With equal values on the seam, its five samples are common vertices.
    mesh = build_mesh(build_strip(left, left[::-1]), resolution=(4, 4), normals=normals)
    assert (mesh.welds, len(mesh.positions)) == (None, 2 * 25 - 5)


@pytest.mark.parametrize(("difference", "is_welded"), [(2.0**-18, True), (2.0**-14, False)])
def test_values_that_differ_by_rounding_weld(difference: float, is_welded: bool) -> None:
    """The largest difference for welding is a share of the range of the values."""
    left = np.array([[[0.0], [0]], [[1], [1]]])
    right = np.array([[[1.0 + difference], [1.0 + difference]], [[0], [0]]])
    mesh = build_mesh(build_strip(left, right), resolution=(1, 1))
    assert len(mesh.positions) == (6 if is_welded else 8)


def test_samples_at_a_crease_have_equal_values_bit_for_bit() -> None:
    """Each place has two normals, but one value of the attribute."""
    random = np.random.default_rng(4)
    edge = random.random((6, 1))
    left, right = random.random((6, 6, 1)), random.random((6, 6, 1))
    left[-1], right[0] = edge, edge + 1e-9
    wall = np.array([[[1.0, 0, 0], [1, 1, 0]], [[1, 0, 1], [1, 1, 1]]])
    mesh = build_mesh(build_attribute_model([SQUARE, wall], [left, right]), resolution=(8, 8))
    assert mesh.welds is not None
    assert len(mesh.positions) == 2 * 81
    rows = find_attribute(mesh, "a")
    np.testing.assert_array_equal(rows, rows[mesh.welds])


def test_channels_do_not_change_positions_and_report() -> None:
    """The values differ at every seam, so vertices repeat positions."""
    surface = build_model(split_quarters(np.random.default_rng(3).random((4, 4, 3))))
    (batch,) = surface.batches
    different_values = np.arange(4.0)[:, None, None, None] + np.zeros((4, 1, 1, 1))
    changed = PatchModel(
        "model",
        (TensorPatches(batch.points, None, (Channel("a", "attribute", different_values),)),),
        surface.parts,
    )
    plain, mesh = (build_mesh(m, resolution=(6, 6)) for m in (surface, changed))
    assert mesh.report == plain.report
    assert len(mesh.positions) == 4 * 49
    assert mesh.welds is not None
    np.testing.assert_array_equal(mesh.positions[mesh.welds == np.arange(4 * 49)], plain.positions)


def test_a_pole_has_as_many_vertices_as_values() -> None:
    """In the first mesh all samples at the pole have one value; in the second, values differ."""
    roof = np.array([[[0.0, 0, 0], [0, 0, 1]], [[1, 0, 0], [0, 0, 1]]])
    ramp = np.array([[[0.0], [0]], [[8], [8]]])
    mesh_of_zeros = build_mesh(build_attribute_model([roof], [ramp * 0]), resolution=(8, 1))
    mesh_of_ramp = build_mesh(build_attribute_model([roof], [ramp]), resolution=(8, 1))
    # The base has 9 vertices. The pole has one vertex, or one for each of the 8 triangles.
    assert len(mesh_of_zeros.positions) == 10
    assert len(mesh_of_ramp.positions) == 17
    assert mesh_of_zeros.report == mesh_of_ramp.report
    check_sound(mesh_of_ramp)


def test_channels_of_indexed_patches_are_polynomials() -> None:
    """They have the degree of the patches, also if the patches are rational."""
    random = np.random.default_rng(2)
    vertices, weights = random.random((12, 3)), random.random(12) + 0.5
    channel_net = random.random((12, 3))
    indices = np.array([[[0, 1, 2], [3, 4, 5], [6, 7, 8]], [[6, 7, 8], [9, 10, 11], [0, 1, 2]]])
    surface = PatchSurface(vertices, indices, weights, channels=Channels(channel_net))
    mesh = build_mesh(surface.lower(), resolution=(3, 4), weld=False)
    expected = np.concatenate([evaluate_exactly(channel_net[index], (3, 4)) for index in indices])
    check_close(mesh.colors, expected, channel_net)


def test_samples_match_only_if_all_channels_agree() -> None:
    """Samples 0, 2, 3 and 4 are at one place; only 0 and 2 are nearly equal in both channels."""
    place = np.array([0, 1, 0, 0, 0])
    first = ChannelRows("a", "attribute", np.array([[1.0], [7], [1 + 1e-9], [1], [0]]))
    second = ChannelRows("b", "attribute", np.array([[3.0, 0], [0, 0], [3, 0], [3, 1], [3, 0]]))
    assert match_values(place, (first, second)).tolist() == [0, 1, 0, 3, 4]
    assert first.values[2] == 1.0  # now equal to the value of sample 0


def test_colors_stay_within_0_and_1() -> None:
    """Rounding alone would make white larger than 1."""
    surface = BezierSurface(SQUARE, channels=Channels(np.ones((65, 65, 3))))
    mesh = build_mesh(surface.lower(), resolution=(37, 41))
    assert mesh.colors is not None
    assert mesh.colors.max() == 1.0
    assert mesh.colors.min() > 1 - 1e-14


@given(st.integers(1, 4), st.integers(0, 7), st.integers(1, 7), st.booleans())
def test_triangles_have_channels_of_their_own_degree(
    degree: int, channel_degree: int, divisions: int, is_float32: bool
) -> None:
    """Compares values with exact values from de Casteljau's algorithm, in the order of samples."""
    random = np.random.default_rng((degree, channel_degree, divisions))
    points = random.random((triangle.count_points(degree), 3))
    colors, flow = (
        random.random((triangle.count_points(channel_degree), 3)),
        random.random((triangle.count_points(3), 2)),
    )
    surface = TriangleSurface(points, channels=Channels(colors, attributes=(("flow", flow),)))
    mesh = build_mesh(surface.lower(), resolution=(divisions, 1), weld=False, is_float32=is_float32)
    assert mesh.colors is not None
    for result, net in ((mesh.colors, colors), (find_attribute(mesh, "flow"), flow)):
        fractions = to_exact_triangle(net)
        expected = [
            [float(x) for x in value(fractions, place)] for place in triangle_places(divisions)
        ]
        check_close(result, expected, net, is_float32)


def test_a_triangle_and_a_square_weld_where_their_values_agree() -> None:
    """The texture coordinates are x and y, so they agree on the common edge."""
    vertices = np.array([[0.0, 0, 0], [0, 1, 0], [1, 0, 0], [1, 1, 0], [2, 0, 0]])
    squares, triangles = np.array([[[0, 1], [2, 3]]]), np.array([[2, 4, 3]])
    channels = Channels(uvs=vertices[:, :2])
    surface = PatchSurface(vertices, squares, channels=channels, triangles=triangles)
    mesh = build_mesh(surface.lower(), resolution=(4, 4))
    assert len(mesh.positions) == 25 + 15 - 5  # the common edge has 5 vertices
    assert mesh.uvs is not None
    np.testing.assert_allclose(mesh.uvs, mesh.positions[:, :2], atol=1e-15)
