"""Surfaces of patches of several degrees and kinds, and closed B-splines with knots very close
together."""

from dataclasses import replace

import numpy as np

from service.surface.bezier import BezierSurface, TriangleSurface
from service.surface.bspline import BsplineSurface
from service.surface.multipatch import MultipatchSurface, Single
from service.surface.patches import NO_TRIANGLES, PatchSurface
from tools.certify.models import BODIES, Complex, build_complex
from tools.certify.nearly import (
    Case,
    WeldedSurface,
    build_closed_spline,
    separate_patches,
    split_spline,
)
from tools.certify.surfaces import Array, Random


def build_mixed(seed: int) -> Case:
    """A surface whose patches have different degrees, of kind `patches` or `multipatch`.

    The members of a multipatch are Bézier patches, B-splines and triangles. In every fifth surface
    a corner of a patch is moved, so that a closed surface becomes open.
    """
    rng = np.random.default_rng([seed, 2])
    kinds = list(BODIES)
    # For even seeds, `build_complex` makes edges of different degrees.
    net_complex = build_complex(kinds[seed % len(kinds)], 2 * seed)
    is_closed = all(len(patches) == 2 for patches in net_complex.edges().values())
    if seed % 5 == 0:
        # The corner of the last patch differs from that of its neighbours.
        net_complex.nets[-1].reshape(-1, 3)[0] += 1e-3 * rng.uniform(0.5, 1, 3)
        is_closed = False
    triangle_sizes = {len(net) for net in net_complex.nets if net.ndim == 2}
    # The kind `patches` has triangles of one degree only.
    is_multipatch = len(triangle_sizes) > 1 or seed // len(kinds) % 2
    surface: WeldedSurface = (
        _build_multipatch(rng, net_complex) if is_multipatch else _build_patches(rng, net_complex)
    )
    return Case(surface, 1e-12, is_closed)


def _build_patches(rng: Random, net_complex: Complex) -> PatchSurface:
    """The model as a surface of kind `patches`, with grids of several degrees and triangles of one.

    Vertices that are equal are one vertex, or every patch has its own vertices.
    """
    sizes = [net[..., 0].size for net in net_complex.nets]
    # The numbers of the vertices of each patch, in the shape of its net.
    patches = [
        np.arange(end - size, end).reshape(net.shape[:-1])
        for end, size, net in zip(np.cumsum(sizes).tolist(), sizes, net_complex.nets, strict=True)
    ]
    vertices = np.concatenate([net.reshape(-1, 3) for net in net_complex.nets])
    if net_complex.weights is not None:
        weights = np.concatenate([each.ravel() for each in net_complex.weights])
        vertices = np.column_stack([vertices, weights])
    if rng.integers(2):
        vertices, new_numbers = np.unique(vertices, axis=0, return_inverse=True)
        patches = [new_numbers.ravel()[each] for each in patches]
    triangles = [each for each in patches if each.ndim == 1]
    return PatchSurface(
        vertices[:, :3].copy(),
        tuple(each for each in patches if each.ndim == 2),
        None if net_complex.weights is None else vertices[:, 3].copy(),
        triangles=np.array(triangles) if triangles else NO_TRIANGLES,
    )


def _build_multipatch(rng: Random, net_complex: Complex) -> MultipatchSurface:
    """The model as a multipatch; a grid becomes a Bézier patch or a B-spline of one span."""
    surfaces: list[Single] = []
    for k, net in enumerate(net_complex.nets):
        weights = None if net_complex.weights is None else net_complex.weights[k]
        if net.ndim == 2:
            surfaces.append(TriangleSurface(net, weights))
        elif rng.integers(2):
            surfaces.append(BezierSurface(net, weights))
        else:
            surfaces.append(
                BsplineSurface(
                    net, _read_degrees(net), _draw_knots(rng, _read_degrees(net)), weights
                )
            )
    return MultipatchSurface(tuple(surfaces))


def _read_degrees(net: Array) -> tuple[int, int]:
    return net.shape[0] - 1, net.shape[1] - 1


def _draw_knots(rng: Random, degrees: tuple[int, int]) -> tuple[Array, Array]:
    """Knots of one span along u and along v, each over a random interval."""
    first, second = (
        rng.uniform(-9, 9) + rng.uniform(0.1, 9) * np.repeat([0.0, 1], degree + 1)
        for degree in degrees
    )
    return first, second


def build_crowded(seed: int) -> Case:
    """A ball or a ring with knots whose distance is 1e-3 to 1e-16 of their range.

    The knots are up to 1e5 times their range away from zero. The surface is a B-spline, its Bézier
    patches, or a multipatch of 2 or 3 strips, split at random parameters. In every fifth multipatch
    a control point on a border is moved, so that the surface is open. But if the knots are so close
    that rounding makes the span vanish, the moved point has no effect, and the surface may be
    closed.
    """
    rng = np.random.default_rng([seed, 3])
    surface = build_closed_spline(rng, has_poles=bool(seed % 2))
    distance = 10.0 ** -(3 + seed // 2 % 14)
    counts = surface.control_net.shape
    # Four variants of each of the 28 pairs of a form, ball or ring, and one of 14 distances.
    variant = seed // 28 % 4
    first, second = (
        _draw_crowded_knots(rng, counts[k], surface.degree[k], distance) for k in range(2)
    )
    surface = BsplineSurface(surface.control_net, surface.degree, (first, second), surface.weights)
    if variant == 0:
        return Case(surface, 1e-12, is_closed=True)
    if variant == 1:
        (batch,) = surface.lower().batches
        return Case(separate_patches(batch), 1e-12, is_closed=True)
    parts = split_spline(rng, surface, strips=variant)
    is_open = seed % 5 == 0
    if is_open:
        net = parts[0].control_net.copy()
        net[0, 1] += 1e-4 * np.ptp(net) * rng.uniform(0.5, 1, 3)
        parts[0] = replace(parts[0], control_net=net)
    # At 1e5 ranges from zero, float64 numbers are 1.5e-11 ranges apart.
    is_closed = None if is_open and distance < 5e-11 else not is_open
    return Case(MultipatchSurface(tuple(parts)), 1e-12, is_closed)


def _draw_crowded_knots(rng: Random, count: int, degree: int, distance: float) -> Array:
    """Clamped knots; inner knots are in groups of at most `degree` knots.

    In a group, the distance of neighbours is `distance` times the range of the knots. The knots are
    up to 1e5 times their range away from zero.
    """
    inner_knots: list[float] = []
    missing_knots = count - degree - 1
    candidates = np.sort(rng.uniform(0.1, 0.9, max(missing_knots, 1))).tolist()
    while missing_knots:
        group_size = min(missing_knots, int(rng.integers(1, degree, endpoint=True)))
        first_knot = candidates[missing_knots - 1]  # another one for each group
        inner_knots += [first_knot + k * distance for k in range(group_size)]
        missing_knots -= group_size
    knots = np.concatenate([np.zeros(degree + 1), np.sort(inner_knots), np.ones(degree + 1)])
    moved_knots: Array = (
        knots + rng.choice([0, 1, -1]) * 10.0 ** rng.integers(0, 6)
    ) * rng.uniform(0.1, 9)
    return moved_knots
