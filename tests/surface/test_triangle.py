"""Triangular surfaces: lowering, tensor form and refusals."""

import numpy as np
import pytest

from service.bases import triangle_basis
from service.surface.batches import TensorPatches, TrianglePatches
from service.surface.channels import Channels
from service.surface.patches import PatchSurface
from service.surface.triangle import TriangleSurface
from tests.oracles import triangles

NET = np.array([(j, k, j * k) for _, j, k in triangles.keys(2)], dtype=float)


def test_lowers_to_one_patch() -> None:
    weights = np.arange(1.0, 7)
    carried = Channels(uvs=np.array([[0.0, 0], [1, 0], [0, 1]]))
    surface = TriangleSurface(NET, weights, "z", "sail", carried)
    model = surface.lower()
    (batch,) = model.batches
    assert isinstance(batch, TrianglePatches)
    assert batch.weights is not None
    np.testing.assert_array_equal(batch.points, NET[None])
    np.testing.assert_array_equal(batch.weights, weights[None])
    assert batch.channels[0].nets.shape == (1, 3, 2)
    assert (surface.degree, batch.degree, batch.side_degrees) == (2, 2, (2, 2, 2, 0))
    assert (model.name, model.up, model.patch_count) == ("sail", "z", 1)


def test_is_frozen_and_copies_its_input() -> None:
    net = NET.copy()
    surface = TriangleSurface(net)
    net[:] = 9
    np.testing.assert_array_equal(surface.control_net, NET)
    with pytest.raises(ValueError, match="read-only"):
        surface.control_net[0] = 0


def test_channels_follow_into_the_tensor_form() -> None:
    """The colour at (u, v) of the tensor form is the colour at s = u (1 − v), t = v."""
    rng = np.random.default_rng(3)
    net = rng.uniform(0, 1, (10, 3))
    carried = Channels(colors=net)
    (batch,) = TriangleSurface(NET, channels=carried).lower().batches
    assert isinstance(batch, TrianglePatches)
    (channel,) = batch.to_tensor().channels
    assert channel.nets.shape == (1, 4, 4, 3)
    u, v = 0.3, 0.6
    place = np.array([[(1 - u) * (1 - v), u * (1 - v), v]])
    expected = triangle_basis.triangle_bernstein(3, place)[:, 0] @ net
    row = np.array([[(1 - u) ** 3, 3 * u * (1 - u) ** 2, 3 * u**2 * (1 - u), u**3]])
    column = np.array([(1 - v) ** 3, 3 * v * (1 - v) ** 2, 3 * v**2 * (1 - v), v**3])
    result = np.einsum("ui,ijd,j->d", row, channel.nets[0], column)
    np.testing.assert_allclose(result, expected, atol=1e-15)


VERTICES = np.array([(x, y, x * y) for x in range(4) for y in range(3)], dtype=float)
GRIDS = np.array([[[0, 1], [3, 4]], [[3, 4], [6, 7]]])
CORNERS = np.array([[1, 2, 4], [4, 5, 7], [7, 8, 10]])


def test_grids_and_triangles_share_vertices() -> None:
    """Grids and triangles become one batch each; both have the values of the vertices."""
    weights = np.arange(1.0, 13)
    carried = Channels(attributes=(("height", VERTICES[:, 2:]),))
    surface = PatchSurface(VERTICES, GRIDS, weights, channels=carried, triangles=CORNERS)
    model = surface.lower()
    grids, corners = model.batches
    assert isinstance(grids, TensorPatches)
    assert isinstance(corners, TrianglePatches)
    assert (surface.degree, surface.triangle_degree) == ((1, 1), 1)
    assert corners.weights is not None
    np.testing.assert_array_equal(grids.points, VERTICES[GRIDS])
    np.testing.assert_array_equal(corners.points, VERTICES[CORNERS])
    np.testing.assert_array_equal(corners.weights, weights[CORNERS])
    np.testing.assert_array_equal(corners.channels[0].nets, VERTICES[CORNERS][..., 2:])
    assert (model.order, model.sequence) == (None, None)
    assert model.patch_count == 5
    (only,) = PatchSurface(VERTICES, triangles=CORNERS).lower().batches
    np.testing.assert_array_equal(only.points, VERTICES[CORNERS])


def test_parts_number_grids_first_and_may_hold_both_kinds() -> None:
    """Any number of parts gives one batch of grids and one of triangles."""
    parts = (("a", (4, 1)), ("b", (2, 3, 0)))
    model = PatchSurface(VERTICES, GRIDS, parts=parts, triangles=CORNERS).lower()
    assert model.order is not None
    assert model.sequence is not None
    assert [(part.name, part.first, part.last) for part in model.parts] == [
        ("b", 0, 3),
        ("a", 3, 5),
    ]
    assert model.order[model.sequence].tolist() == [2, 3, 0, 4, 1]
    points = [net for batch in model.batches for net in batch.points]
    listed = [VERTICES[grid] for grid in GRIDS] + [VERTICES[corner] for corner in CORNERS]
    for number, net in zip(model.order, points, strict=True):
        np.testing.assert_array_equal(net, listed[number])
