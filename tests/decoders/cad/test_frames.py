"""Vectors and frames, also for directions that are missing, parallel or damaged."""

from math import inf, nan, sqrt

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from service.decoders.cad.faults import InvalidGeometry
from service.decoders.cad.frames import (
    Frame,
    Vector,
    add,
    build_frame,
    cross,
    distance,
    dot,
    norm,
    scale,
    subtract,
    transform_frame,
    unit,
)

coordinates = st.floats(-100, 100)
vectors = st.tuples(coordinates, coordinates, coordinates)


@given(a=vectors, b=vectors)
def test_vectors(a: Vector, b: Vector) -> None:
    p, q = np.array(a), np.array(b)
    assert np.array(add(a, b)) == pytest.approx(p + q)
    assert np.array(subtract(a, b)) == pytest.approx(p - q)
    assert np.array(scale(a, 3.0)) == pytest.approx(3 * p)
    assert dot(a, b) == pytest.approx(float(p @ q))
    assert np.array(cross(a, b)) == pytest.approx(np.cross(p, q))
    assert distance(a, b) == pytest.approx(float(np.linalg.norm(p - q)))


def check_frame(frame: Frame) -> None:
    rows = np.array([frame.x, frame.y, frame.z])
    assert rows @ rows.T == pytest.approx(np.eye(3), abs=1e-14)
    assert np.linalg.det(rows) == pytest.approx(1.0)


@given(origin=vectors, z=vectors, x=vectors, point=vectors)
def test_frames_are_right_handed(origin: Vector, z: Vector, x: Vector, point: Vector) -> None:
    if norm(z) == 0.0 or norm(x) == 0.0:
        with pytest.raises(InvalidGeometry, match="no length"):
            build_frame(origin, z, x)
        return
    frame = build_frame(origin, z, x)
    check_frame(frame)
    assert frame.z == unit(z)
    assert np.array(frame.place(*frame.locate(point))) == pytest.approx(point, abs=1e-12 * 400)
    located = frame.locate_all(np.array([point]))[:, 0]
    assert located == pytest.approx(np.array(frame.locate(point)), abs=1e-12)


@pytest.mark.parametrize(
    ("z", "x", "expected"),
    [
        (None, None, (1, 0, 0)),
        ((0.0, 0.0, 2.0), None, (1, 0, 0)),
        ((3.0, 0.0, 0.0), None, (0, 1, 0)),
        ((0.0, 1.0, 1.0), (0.0, 2.0, 2.0), (1, 0, 0)),
        ((-1.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0, 1, 0)),
    ],
)
def test_missing_and_parallel_directions(
    z: Vector | None, x: Vector | None, expected: Vector
) -> None:
    frame = build_frame((0.0, 0.0, 0.0), z, x)
    check_frame(frame)
    assert frame.x == pytest.approx(expected)


@pytest.mark.parametrize("vector", [(0.0, 0.0, 0.0), (nan, 0.0, 1.0), (inf, 0.0, 1.0)])
def test_directions_without_a_length_are_refused(vector: Vector) -> None:
    with pytest.raises(InvalidGeometry, match="no length"):
        unit(vector)


@pytest.mark.parametrize("size", [5e-324, 1e-300, 1e300])
def test_directions_of_any_length(size: float) -> None:
    assert unit((size, size, 0.0)) == pytest.approx((sqrt(0.5), sqrt(0.5), 0.0))


def test_an_infinite_origin_is_refused() -> None:
    with pytest.raises(InvalidGeometry, match="finite"):
        build_frame((0.0, nan, 0.0))


def test_frames_after_rotations() -> None:
    base = build_frame((1.0, 2.0, 3.0), (0.3, 0.4, -0.2), (1.0, 0.0, 0.0))
    matrix = np.eye(4)
    matrix[:3, :3] = np.array([base.x, base.y, base.z]).T
    matrix[:3, 3] = base.origin
    frame = build_frame((5.0, -1.0, 0.5), (0.1, 0.9, 0.3), (1.0, 1.0, 0.0))
    moved = transform_frame(frame, matrix)
    assert moved is not None
    check_frame(moved)
    point = matrix @ (*frame.place(1.0, 2.0, 3.0), 1.0)
    assert np.array(moved.place(1.0, 2.0, 3.0)) == pytest.approx(point[:3])
    for factor in (np.diag([1, 1, -1, 1.0]), np.diag([2, 2, 2, 1.0]), np.zeros((4, 4))):
        assert transform_frame(frame, matrix @ factor) is None
