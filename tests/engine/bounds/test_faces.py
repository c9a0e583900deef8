"""Faces cross knot lines unless the surface is discontinuous, degenerate or touches itself
there."""

from math import pi

import numpy as np

from service.engine.bounds.faces import Faces, find_faces
from service.engine.connectivity.seams import find_seams
from service.surface.bspline import BsplineSurface
from service.surface.lowered import PatchModel
from tests.strategies import Array, translate


def find_model_faces(model: PatchModel) -> Faces:
    return find_faces(model, find_seams(model.batches))


def check_cover(model: PatchModel, faces: Faces) -> None:
    """Every patch is in one face."""
    result = [
        first + k * stride + i
        for first, stride, (rows, columns) in zip(
            faces.first.tolist(), faces.stride.tolist(), faces.spans.T.tolist(), strict=True
        )
        for k in range(rows)
        for i in range(columns)
    ]
    assert sorted(result) == list(range(model.patch_count))


def build_wave(rows: int, columns: int) -> Array:
    """A control net of a wave."""
    u, v = np.meshgrid(np.arange(float(rows)), np.arange(float(columns)), indexing="ij")
    return np.stack([u, v, np.sin(u + v * v)], axis=-1)


def test_a_spline_is_one_face() -> None:
    """Periodic splines are one face, too."""
    for knots in ("clamped", "uniform", "periodic"):
        model = BsplineSurface(build_wave(7, 9), (3, 2), (knots, "clamped")).lower()
        faces = find_model_faces(model)
        check_cover(model, faces)
        assert len(faces.first) == 1
        assert faces.spans[:, 0].prod() == model.patch_count


def test_a_face_ends_where_a_surface_is_discontinuous() -> None:
    """A knot of multiplicity degree + 1 separates faces."""
    knots = np.array([0.0, 0, 0, 1, 2, 2, 2, 3, 3, 3])
    model = BsplineSurface(build_wave(7, 6), (2, 3), (knots, "clamped")).lower()
    faces = find_model_faces(model)
    check_cover(model, faces)
    assert faces.spans.T.tolist() == [[2, 3], [1, 3]]
    assert faces.first.tolist() == [0, 6]


def test_a_face_ends_where_a_knot_line_is_a_point() -> None:
    """A double cone: the knot line between the two cones is their common apex."""
    angle = 2 * pi * np.arange(6) / 6
    ring = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=-1)
    net = np.stack([translate(ring, 0, 0, -1), 0 * ring, translate(ring, 0, 0, 1)])
    model = BsplineSurface(net, (1, 3), ("clamped", "periodic")).lower()
    faces = find_model_faces(model)
    check_cover(model, faces)
    assert faces.spans.T.tolist() == [[1, 6], [1, 6]]


def test_a_face_ends_where_a_surface_touches_itself() -> None:
    """A sheet folded back: of its knot lines 0 to 5, two have x = 1 and z = 0."""
    x = np.array([0.0, 1, 2, 2, 1, 1])
    z = np.array([0.0, 0, 0, 1, 0, -1])
    net = np.stack([np.stack([x, x * 0 + y, z], axis=-1) for y in range(3)], axis=1)
    model = BsplineSurface(net, (1, 1)).lower()
    faces = find_model_faces(model)
    check_cover(model, faces)
    assert faces.spans.T.tolist() == [[1, 2], [3, 2], [1, 2]]


def test_a_face_ends_where_a_side_becomes_a_point() -> None:
    """A spline of degree 2 with three equal control points on a side: its middle span is a point.

    Faces end before and after this span.
    """
    net = build_wave(5, 5)
    net[1:4, 0] = net[1, 0]
    model = BsplineSurface(net, (2, 2)).lower()
    faces = find_model_faces(model)
    check_cover(model, faces)
    seams = find_seams(model.batches)
    assert seams.collapsed[:, 2].sum() == 1
    assert faces.spans.T.tolist() == [[1, 3], [1, 3], [1, 3]]
