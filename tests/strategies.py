"""Hypothesis strategies for control nets, weights and models of several patches.

Coordinates are small multiples of 1/16. So halving a net and subtracting its points are exact in
floating point, and tests can compare results with `==`.
"""

from collections.abc import Iterable, Sequence
from typing import Any

import numpy as np
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays
from numpy.typing import NDArray

from oracles import triangles
from oracles.exact import split
from service.surface.batches import Patches, TensorPatches, TrianglePatches
from service.surface.lowered import Part, PatchModel

Array = NDArray[np.float64]

GRAIN = 16
"""Coordinates are multiples of 1/GRAIN."""

ROTATIONS = (0, 3, 5, 6)
"""The symmetries of the parameter square that keep its orientation; see `apply_symmetry`."""

degrees = st.integers(1, 5)
resolutions = st.tuples(st.integers(1, 7), st.integers(1, 7))
symmetries = st.integers(0, 7)


def _multiples(limit: int) -> st.SearchStrategy[float]:
    return st.integers(-limit * GRAIN, limit * GRAIN).map(lambda k: k / GRAIN)


@st.composite
def nets(draw: st.DrawFn, degree: st.SearchStrategy[int] = degrees, limit: int = 8) -> Array:
    """A control net of shape (p+1, q+1, 3), every coordinate independent."""
    shape = (draw(degree) + 1, draw(degree) + 1, 3)
    return draw(arrays.arrays(np.float64, shape, elements=_multiples(limit)))


@st.composite
def height_nets(draw: st.DrawFn, degree: st.SearchStrategy[int] = degrees) -> Array:
    """A net over a regular grid in x and y: a surface without folds, du × dv always upwards."""
    p, q = draw(degree), draw(degree)
    heights = draw(arrays.arrays(np.float64, (p + 1, q + 1), elements=_multiples(4)))
    x, y = np.meshgrid(np.arange(p + 1.0), np.arange(q + 1.0), indexing="ij")
    return np.stack([x, y, heights], axis=-1)


def weights_like(net: Array) -> st.SearchStrategy[Array]:
    """Weights from 0.2 to 5 for a net."""
    weight = st.integers(13, 320).map(lambda k: k / 64)
    return arrays.arrays(np.float64, net.shape[:-1], elements=weight)


@st.composite
def weighted_nets(
    draw: st.DrawFn, base: st.SearchStrategy[Array] | None = None
) -> tuple[Array, Array | None]:
    """A net and its weights, or None in half of the examples."""
    net = draw(nets() if base is None else base)
    return net, draw(st.none() | weights_like(net))


@st.composite
def degenerate_nets(draw: st.DrawFn) -> Array:
    """Nets with one to three of FAULTS, for example a collapsed side or all points on a line."""
    net = draw(nets(degree=st.integers(1, 4))).copy()
    for fault in draw(st.lists(st.sampled_from(FAULTS), min_size=1, max_size=3)):
        net = fault(net)
    return net


def _collapse_side(net: Array) -> Array:
    net[0, :] = net[0, 0]
    return net


def _collapse_other_side(net: Array) -> Array:
    net[:, -1] = net[-1, -1]
    return net


def _repeat_row(net: Array) -> Array:
    net[1] = net[0]
    return net


def _repeat_column(net: Array) -> Array:
    net[:, -2] = net[:, -1]
    return net


def _flatten(net: Array) -> Array:
    net[..., 2] = 0
    return net


def _align(net: Array) -> Array:
    net[..., 1:] = net[..., :1]
    return net


def _condense(net: Array) -> Array:
    net[...] = net[0, 0]
    return net


def _fold(net: Array) -> Array:
    net[-1] = net[0]
    return net


FAULTS = (
    _collapse_side,
    _collapse_other_side,
    _repeat_row,
    _repeat_column,
    _flatten,
    _align,
    _condense,
    _fold,
)


def apply_symmetry(net: Array, symmetry: int) -> Array:
    """One of the eight symmetries of the square: bits 0 and 1 reverse u and v, bit 2 swaps them."""
    net = net[::-1] if symmetry & 1 else net
    net = net[:, ::-1] if symmetry & 2 else net
    return net.swapaxes(0, 1) if symmetry & 4 else net


def translate(net: Array, x: float, y: float = 0.0, z: float = 0.0) -> Array:
    """The net, moved by (x, y, z)."""
    result: Array = net + np.array([x, y, z])
    return result


def split_quarters(net: Array) -> list[Array]:
    """The four patches that a net is split into at u = v = ½."""
    halves = split(net)
    return [quarter.swapaxes(0, 1) for half in halves for quarter in split(half.swapaxes(0, 1))]


def build_model(
    patches: Iterable[Array], weights: Iterable[Array] | None = None, name: str = "model"
) -> PatchModel:
    """A model of the patches with these control nets (p+1, q+1, 3), of any degrees.

    Consecutive patches of the same degrees share a batch. As in every surface, −0.0 becomes 0.0.
    """
    points = [np.array(net, dtype=np.float64) + 0.0 for net in patches]
    weight_nets = None if weights is None else [np.array(w, dtype=np.float64) for w in weights]
    batches: list[TensorPatches] = []
    begin = 0
    for end in range(1, len(points) + 1):
        if end == len(points) or points[end].shape != points[begin].shape:
            batches.append(
                TensorPatches(
                    np.stack(points[begin:end]),
                    None if weight_nets is None else np.stack(weight_nets[begin:end]),
                )
            )
            begin = end
    return PatchModel(name, tuple(batches), (Part(name, 0, len(points)),))


@st.composite
def triangle_nets(draw: st.DrawFn, degree: st.SearchStrategy[int] = degrees) -> Array:
    """A triangular net of shape ((n+1)(n+2)/2, 3), every coordinate independent."""
    n = draw(degree)
    shape = ((n + 1) * (n + 2) // 2, 3)
    return draw(arrays.arrays(np.float64, shape, elements=_multiples(8)))


@st.composite
def triangle_heights(draw: st.DrawFn, degree: st.SearchStrategy[int] = degrees) -> Array:
    """A triangular net over a regular grid in x and y: s along x, t along y, normals upwards."""
    n = draw(degree)
    grid = np.array([(j, k) for _, j, k in triangles.keys(n)], dtype=float)
    heights = draw(arrays.arrays(np.float64, len(grid), elements=_multiples(4)))
    return np.concatenate([grid, heights[:, None]], axis=1)


def build_mixed_model(
    nets_: Sequence[Array], weights: Sequence[Array] | None = None, name: str = "model"
) -> PatchModel:
    """A model of tensor-product nets (p+1, q+1, 3) and triangular nets (K, 3), a batch for each."""
    batches: list[Patches] = []
    for number, net in enumerate(nets_):
        points = np.array(net, dtype=np.float64)[None] + 0.0
        batch_weights = (
            None if weights is None else np.array(weights[number], dtype=np.float64)[None]
        )
        kind = TrianglePatches if net.ndim == 2 else TensorPatches
        batches.append(kind(points, batch_weights))
    return PatchModel(name, tuple(batches), (Part(name, 0, len(batches)),))


@st.composite
def split_models(draw: st.DrawFn, oriented: bool = True) -> tuple[Array, list[Array]]:
    """A net and its four quarters, in random orientations and in any order.

    With `oriented` the quarters are only rotated, so that all normals point to the same side.
    """
    net = draw(height_nets(degree=st.integers(1, 4)))
    turn = st.sampled_from(ROTATIONS) if oriented else symmetries
    pieces = [apply_symmetry(piece, draw(turn)) for piece in split_quarters(net)]
    return net, draw(st.permutations(pieces))


def build_cube(symmetry: Sequence[int] = (0,) * 6) -> list[Array]:
    """Six bilinear patches on the faces of the unit cube.

    Their normals point outwards, unless `symmetry`, one number for each face, reverses them (see
    `apply_symmetry`).
    """
    square = np.array([[[0, 0, 1], [0, 1, 1]], [[1, 0, 1], [1, 1, 1]]], dtype=float)
    faces: list[Any] = []
    for axis in range(3):
        top = np.roll(square, axis + 1, axis=-1)
        # Swapping u and v turns the normal of the opposite face outwards.
        bottom = top.swapaxes(0, 1).copy()
        bottom[..., axis] = 0
        faces += [top, bottom]
    return [apply_symmetry(face, s) for face, s in zip(faces, symmetry, strict=True)]


@st.composite
def placements(draw: st.DrawFn) -> Array:
    """Invertible affine matrices (4, 4): random rotations, scalings, shears and mirror images."""
    entries = arrays.arrays(np.float64, (3, 3), elements=_multiples(2))
    linear = draw(entries.filter(lambda m: abs(np.linalg.det(m)) > 0.25))
    matrix = np.eye(4)
    matrix[:3, :3] = linear
    matrix[:3, 3] = draw(arrays.arrays(np.float64, 3, elements=_multiples(8)))
    return matrix
