"""Surfaces whose borders are equal up to rounding, or are one curve in different forms.

Each of the functions `build_noisy`, `build_pieces` and `build_noisy_pieces` is a family: it builds
a surface from a seed, and says whether its mesh must be closed. Two more are in
`tools.certify.crowded`; the table of all families is in `tools.certify.closing`.
"""

from dataclasses import dataclass, replace
from itertools import pairwise
from typing import TypeAlias

import numpy as np
from scipy.interpolate import BSpline

from service.surface.batches import TensorPatches
from service.surface.bspline import BsplineSurface
from service.surface.convert.operations import Elevate, Operation, Restrict, Reverse, Transpose
from service.surface.convert.table import convert
from service.surface.multipatch import MultipatchSurface, Single
from service.surface.patches import PatchSurface
from tools.certify.surfaces import Random
from tools.certify.written import Array

WeldedSurface: TypeAlias = BsplineSurface | PatchSurface | MultipatchSurface
"""Kinds of surfaces with several patches, whose borders the service joins."""


@dataclass(frozen=True)
class Case:
    """A surface, the `weld_tolerance` of its mesh, and whether the mesh must be closed.

    `weld_tolerance` is relative to the diagonal of the surface. `is_closed` is None if the mesh may
    be closed or open.
    """

    surface: WeldedSurface
    weld_tolerance: float
    is_closed: bool | None

    def accepts(self, is_watertight: bool) -> bool:
        """Whether a mesh that is, or is not, watertight is correct."""
        return self.is_closed is None or self.is_closed == is_watertight


def build_noisy(seed: int) -> Case:
    """A ball or a ring, as a B-spline or as patches, with noise of 1e-17 to 1e-9 of its size.

    The noise moves points by at most an amplitude a, so that equal points get a distance of at most
    2 a. The mesh must be closed if 2 a is below the tolerance, and open if a is above it; if a is
    equal to it, the mesh may be either.
    """
    rng = np.random.default_rng(seed)
    amplitude = 10.0 ** -(9 + seed % 9)
    tolerance = 1e-12 if seed % 2 else max(3 * amplitude, 1e-15)
    surface: BsplineSurface | PatchSurface = build_closed_spline(rng, has_poles=bool(seed // 2 % 2))
    if seed // 4 % 2:
        surface = separate_patches(surface.lower().batches[0])
    is_closed = None if amplitude == tolerance else 2 * amplitude < tolerance
    return Case(add_noise(rng, surface, amplitude), tolerance, is_closed)


def build_pieces(seed: int) -> Case:
    """A ball or a ring of B-splines whose common borders are one curve in different forms.

    The surface is split into strips, and each strip into parts at its own random parameters. Then
    knots are inserted, degrees raised, parameters scaled, directions reversed and exchanged. For
    every third seed a point on a border is moved, so that the surface is open.
    """
    rng = np.random.default_rng([seed, 1])
    parts = split_spline(rng, build_closed_spline(rng, has_poles=bool(seed % 2)), 2 + seed // 2 % 2)
    is_closed = seed % 3 > 0
    if not is_closed:
        net = parts[0].control_net.copy()
        net[0, 1] += 1e-4 * np.ptp(net) * rng.uniform(0.5, 1, 3)
        parts[0] = replace(parts[0], control_net=net)
    order = rng.permutation(len(parts))
    return Case(MultipatchSurface(tuple(parts[k] for k in order)), 1e-12, is_closed)


def build_noisy_pieces(seed: int) -> Case:
    """A ball or a ring of B-splines in different forms, with noise of 1e-13 to 1e-7 of its size.

    The forms are those of `build_pieces`. For even seeds the corners of all nets have no noise, so
    that of borders of different degrees no two control points are near but unequal. In every third
    surface the noise is 30 times the tolerance, and the mesh must be open.
    """
    rng = np.random.default_rng([seed, 4])
    parts = split_spline(rng, build_closed_spline(rng, has_poles=bool(seed // 2 % 2)), 2)
    amplitude, is_closed = 10.0 ** -(7 + seed // 4 % 7), seed % 3 > 0
    reach = amplitude * float(
        np.linalg.norm(np.ptp(list_points(MultipatchSurface(tuple(parts))), axis=0))
    )
    noisy = []
    for part in parts:
        shift = rng.uniform(-1, 1, part.control_net.shape) * (reach / 2)
        factor = 1 + amplitude / 2 * rng.uniform(-1, 1, shift.shape[:2])
        if seed % 2 == 0:
            shift[np.ix_([0, -1], [0, -1])], factor[np.ix_([0, -1], [0, -1])] = 0, 1
        weights = None if part.weights is None else part.weights * factor
        noisy.append(replace(part, control_net=part.control_net + shift, weights=weights))
    tolerance = 3 * amplitude if is_closed else amplitude / 30
    return Case(MultipatchSurface(tuple(noisy)), tolerance, is_closed)


def split_spline(rng: Random, surface: BsplineSurface, strips: int) -> list[BsplineSurface]:
    """A surface split into `strips` strips along u, and each strip into one to three parts along v.

    Every part gets a form of its own.
    """
    parts: list[BsplineSurface] = []
    for u in _divide_domain(rng, surface, 0, strips):
        strip = convert(surface, [Restrict(u=u)])
        assert isinstance(strip, BsplineSurface)
        for v in _divide_domain(rng, strip, 1, int(rng.integers(1, 4))):
            piece = convert(strip, [Restrict(v=v)])
            assert isinstance(piece, BsplineSurface)
            parts.append(_change_form(rng, piece))
    return parts


def _divide_domain(
    rng: Random, surface: BsplineSurface, axis: int, count: int
) -> list[tuple[float, float]]:
    """`count` intervals that the domain along an axis is divided into, at random parameters."""
    knots, degree = surface.knot_vectors[axis], surface.degree[axis]
    low, high = float(knots[degree]), float(knots[-1 - degree])
    inner_ends = (
        low + (high - low) * (np.arange(1, count) + rng.uniform(-0.3, 0.3, count - 1)) / count
    )
    ends = [low, *inner_ends.tolist(), high]
    return list(pairwise(ends))


def _change_form(rng: Random, piece: BsplineSurface) -> BsplineSurface:
    """A piece in another form, with the same points.

    Weights and knots are scaled, knots may be inserted, degrees raised, and directions reversed or
    exchanged.
    """
    homogeneous = np.ones((*piece.control_net.shape[:2], 4))
    if piece.weights is not None:
        homogeneous[..., 3] = piece.weights * rng.uniform(0.5, 2)
    homogeneous[..., :3] = piece.control_net * homogeneous[..., 3:]
    knots = []
    for axis in range(2):
        coefficients = homogeneous.swapaxes(0, axis)
        spline = BSpline(piece.knot_vectors[axis], coefficients, piece.degree[axis])
        low, high = spline.t[spline.k], spline.t[-1 - spline.k]
        for _ in range(int(rng.integers(3))):
            spline = spline.insert_knot(low + (high - low) * rng.uniform(0.1, 0.9))
        homogeneous = spline.c.swapaxes(0, axis)
        knots.append(spline.t * rng.uniform(0.3, 3) + rng.uniform(-2, 2))
    net, weights = homogeneous[..., :3] / homogeneous[..., 3:], homogeneous[..., 3]
    refined = BsplineSurface(
        net, piece.degree, (knots[0], knots[1]), None if piece.weights is None else weights
    )
    p, q = piece.degree
    raises = rng.integers(0, 4, 2) == 0
    choices: list[Operation] = [Reverse("u"), Reverse("v"), Transpose()]
    operations = [operation for operation in choices if rng.integers(2)]
    result = convert(refined, [Elevate((p + int(raises[0]), q + int(raises[1]))), *operations])
    assert isinstance(result, BsplineSurface)
    return result


def build_closed_spline(rng: Random, *, has_poles: bool) -> BsplineSurface:
    """A closed B-spline: a ball with poles at both ends of v, or a ring closed along u and v.

    Points repeat bit for bit: the last row equals the first, and with a ring the last column, too.
    """
    p, q = rng.integers(1, 4, 2, endpoint=True).tolist()
    n, m = (int(rng.integers(max(d + 1, 4), d + 6)) for d in (p, q))
    turn = np.linspace(0, 2 * np.pi, n)[:, None]
    across = np.linspace(0, np.pi if has_poles else 2 * np.pi, m)
    radius = (0 if has_poles else 3) + (np.sin(across) if has_poles else np.cos(across))
    height = np.cos(across) if has_poles else np.sin(across)
    net = np.stack(
        np.broadcast_arrays(radius * np.cos(turn), radius * np.sin(turn), height), axis=-1
    )
    net = (net * rng.uniform(0.8, 1.2, net.shape)) @ np.linalg.qr(rng.normal(size=(3, 3)))[0]
    weights = rng.uniform(0.5, 2, (n, m)) if rng.integers(2) else None
    for rows in (net,) if weights is None else (net, weights):
        rows[-1] = rows[0]
        if not has_poles:
            rows[:, -1] = rows[:, 0]
    if has_poles:
        net[:, 0], net[:, -1] = net[0, 0], net[0, -1]
    return BsplineSurface(net, (p, q), weights=weights)


def separate_patches(batch: object) -> PatchSurface:
    """The patches of a batch as a surface; they share no vertices, and each is a part."""
    assert isinstance(batch, TensorPatches)
    indices = np.arange(batch.points[..., 0].size).reshape(batch.points.shape[:-1])
    weights = None if batch.weights is None else batch.weights.ravel()
    parts = tuple((f"patch {k}", (k,)) for k in range(batch.count))
    return PatchSurface(batch.points.reshape(-1, 3), indices, weights, parts)


def add_noise(
    rng: Random, surface: BsplineSurface | PatchSurface, amplitude: float
) -> WeldedSurface:
    """The surface with random noise on its points and weights.

    Points move by at most `amplitude` times the diagonal, weights by a relative 0.9 `amplitude`.
    """
    points = list_points(surface)
    # Factors slightly below 1 leave room for rounding.
    reach = amplitude * np.linalg.norm(np.ptp(points, axis=0)) * (1 - 2.0**-10)
    noise = rng.normal(size=points.shape)
    noise *= reach * rng.uniform(0, 1, (len(points), 1)) / np.linalg.norm(noise, axis=1)[:, None]
    noisy_points = points + noise
    weights = surface.weights
    if weights is not None:
        weights = weights * (1 + 0.9 * amplitude * rng.uniform(-1, 1, weights.shape))
    if isinstance(surface, PatchSurface):
        return replace(surface, vertices=noisy_points, weights=weights)
    return replace(
        surface, control_net=noisy_points.reshape(surface.control_net.shape), weights=weights
    )


def list_points(surface: WeldedSurface | Single) -> Array:
    """All control points (N, 3) of a surface."""
    if isinstance(surface, MultipatchSurface):
        return np.concatenate([list_points(each) for each in surface.surfaces])
    points = surface.vertices if isinstance(surface, PatchSurface) else surface.control_net
    return points.reshape(-1, 3)
