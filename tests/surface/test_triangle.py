"""Triangular surfaces: lowering, tensor-product form, and triangles beside other patches."""

import numpy as np
import pytest

from oracles import triangles
from service.bases import triangle_basis
from service.surface.batches import TensorPatches, TrianglePatches
from service.surface.bezier import TriangleSurface
from service.surface.channels import Channels
from service.surface.patches import PatchSurface

NET = np.array([(j, k, j * k) for _, j, k in triangles.keys(2)], dtype=float)


def test_a_triangle_is_lowered_to_one_patch() -> None:
    weights = np.arange(1.0, 7)
    channels = Channels(uvs=np.array([[0.0, 0], [1, 0], [0, 1]]))
    surface = TriangleSurface(NET, weights, "z", "sail", channels)
    model = surface.lower()
    (batch,) = model.batches
    assert isinstance(batch, TrianglePatches)
    assert batch.weights is not None
    np.testing.assert_array_equal(batch.points, NET[None])
    np.testing.assert_array_equal(batch.weights, weights[None])
    assert batch.channels[0].nets.shape == (1, 3, 2)
    # A triangle counts as a patch whose last side is one point.
    assert (surface.degree, batch.degree, batch.side_degrees) == (2, 2, (2, 2, 2, 0))
    assert (model.name, model.up, model.patch_count) == ("sail", "z", 1)


def test_a_surface_is_frozen_and_copies_the_array_of_the_caller() -> None:
    net = NET.copy()
    surface = TriangleSurface(net)
    net[:] = 9
    np.testing.assert_array_equal(surface.control_net, NET)
    with pytest.raises(ValueError, match="read-only"):
        surface.control_net[0] = 0


def test_the_tensor_product_form_has_the_channels_of_the_triangle() -> None:
    """The colour of the tensor-product form at (u, v) is the colour at s = u (1 − v), t = v."""
    rng = np.random.default_rng(3)
    net = rng.uniform(0, 1, (10, 3))
    channels = Channels(colors=net)
    (batch,) = TriangleSurface(NET, channels=channels).lower().batches
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
    """The grids become one batch and the triangles another; both index the same vertices."""
    weights = np.arange(1.0, 13)
    channels = Channels(attributes=(("height", VERTICES[:, 2:]),))
    surface = PatchSurface(VERTICES, GRIDS, weights, channels=channels, triangles=CORNERS)
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
    # Without parts, patches keep the numbers and the order that they have in the request.
    assert (model.request_numbers, model.sequence) == (None, None)
    assert model.patch_count == 5
    (batch,) = PatchSurface(VERTICES, triangles=CORNERS).lower().batches
    np.testing.assert_array_equal(batch.points, VERTICES[CORNERS])


def test_parts_may_have_grids_and_triangles_which_are_numbered_after_the_grids() -> None:
    """With several parts, the model still has one batch of grids and one batch of triangles."""
    parts = (("a", (4, 1)), ("b", (2, 3, 0)))
    model = PatchSurface(VERTICES, GRIDS, parts=parts, triangles=CORNERS).lower()
    assert model.request_numbers is not None
    assert model.sequence is not None
    assert [(part.name, part.first, part.last) for part in model.parts] == [
        ("b", 0, 3),
        ("a", 3, 5),
    ]
    # Part after part, the numbers that the patches have in the request.
    assert model.request_numbers[model.sequence].tolist() == [2, 3, 0, 4, 1]
    points = [net for batch in model.batches for net in batch.points]
    expected = [VERTICES[grid] for grid in GRIDS] + [VERTICES[corner] for corner in CORNERS]
    for number, net in zip(model.request_numbers, points, strict=True):
        np.testing.assert_array_equal(net, expected[number])
