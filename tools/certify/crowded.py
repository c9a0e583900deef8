"""Bodies of patches of several degrees and kinds, and of B-splines whose knots are close
together."""

from dataclasses import replace

import numpy as np

from service.surface.bezier import BezierSurface
from service.surface.bspline import BsplineSurface
from service.surface.multipatch import MultipatchSurface, Single
from service.surface.patches import NO_TRIANGLES, PatchSurface
from service.surface.triangle import TriangleSurface
from tools.certify.models import BODIES, Complex, build_complex
from tools.certify.nearly import Case, Pieces, body, cut_up, soup
from tools.certify.surfaces import Array, Random


def mixed(seed: int) -> Case:
    """A body whose patches have different degrees, as `patches` or as a `multipatch`.

    Grids of a multipatch are Bézier patches and B-splines. In every fifth body a corner of a patch
    is moved, so the body is open.
    """
    rng = np.random.default_rng([seed, 2])
    kinds = list(BODIES)
    net_complex = build_complex(kinds[seed % len(kinds)], 2 * seed)
    is_closed = all(len(patches) == 2 for patches in net_complex.edges().values())
    if seed % 5 == 0:
        # The corner of the last patch differs from that of its neighbours.
        net_complex.nets[-1].reshape(-1, 3)[0] += 1e-3 * rng.uniform(0.5, 1, 3)
        is_closed = False
    triangles = {len(net) for net in net_complex.nets if net.ndim == 2}
    is_list = len(triangles) > 1 or seed // len(kinds) % 2
    surface: Pieces = _multipatch(rng, net_complex) if is_list else _patches(rng, net_complex)
    return Case(surface, 1e-12, is_closed)


def _patches(rng: Random, net_complex: Complex) -> PatchSurface:
    """A model with grids of several degrees and triangles of one degree.

    Patches share all equal vertices, or no vertices.
    """
    ends = np.cumsum([0, *(net[..., 0].size for net in net_complex.nets)]).tolist()
    rows = [
        np.arange(first, first + net[..., 0].size).reshape(net.shape[:-1])
        for first, net in zip(ends, net_complex.nets, strict=False)
    ]
    numbers = np.concatenate([net.reshape(-1, 3) for net in net_complex.nets])
    if net_complex.weights is not None:
        weights = np.concatenate([each.ravel() for each in net_complex.weights])
        numbers = np.column_stack([numbers, weights])
    if rng.integers(2):
        numbers, place = np.unique(numbers, axis=0, return_inverse=True)
        rows = [place.ravel()[each] for each in rows]
    triangles = [each for each in rows if each.ndim == 1]
    return PatchSurface(
        numbers[:, :3].copy(),
        tuple(each for each in rows if each.ndim == 2),
        None if net_complex.weights is None else numbers[:, 3].copy(),
        triangles=np.array(triangles) if triangles else NO_TRIANGLES,
    )


def _multipatch(rng: Random, net_complex: Complex) -> MultipatchSurface:
    surfaces: list[Single] = []
    for k, net in enumerate(net_complex.nets):
        weights = None if net_complex.weights is None else net_complex.weights[k]
        if net.ndim == 2:
            surfaces.append(TriangleSurface(net, weights))
        elif rng.integers(2):
            surfaces.append(BezierSurface(net, weights))
        else:
            surfaces.append(BsplineSurface(net, _degrees(net), _ends(rng, _degrees(net)), weights))
    return MultipatchSurface(tuple(surfaces))


def _degrees(net: Array) -> tuple[int, int]:
    return net.shape[0] - 1, net.shape[1] - 1


def _ends(rng: Random, degrees: tuple[int, int]) -> tuple[Array, Array]:
    """The knots of one span along u and along v, each over a random interval."""
    first, second = (
        rng.uniform(-9, 9) + rng.uniform(0.1, 9) * np.repeat([0.0, 1], degree + 1)
        for degree in degrees
    )
    return first, second


def crowded(seed: int) -> Case:
    """A ball or a ring whose knots are as near as 1e-3 to 1e-16 of their range, up to 1e5 ranges
    from zero.

    It is a B-spline, its patches, or pieces that are cut at random parameters. In every fifth
    surface a control point on a border is moved, so the surface is open. Pieces have their own
    knots, rounded far from zero. If rounding makes a span vanish, moving one of its points has no
    effect.
    """
    rng = np.random.default_rng([seed, 3])
    surface = body(rng, has_poles=bool(seed % 2))
    gap = 10.0 ** -(3 + seed // 2 % 14)
    counts = surface.control_net.shape
    form = seed // 28 % 4
    first, second = (_crowd(rng, counts[k], surface.degree[k], gap) for k in range(2))
    surface = BsplineSurface(surface.control_net, surface.degree, (first, second), surface.weights)
    if form == 0:
        return Case(surface, 1e-12, is_closed=True)
    if form == 1:
        (batch,) = surface.lower().batches
        return Case(soup(batch), 1e-12, is_closed=True)
    pieces = cut_up(rng, surface, form)
    if seed % 5 == 0:
        net = pieces[0].control_net.copy()
        net[0, 1] += 1e-4 * np.ptp(net) * rng.uniform(0.5, 1, 3)
        pieces[0] = replace(pieces[0], control_net=net)
    is_open = seed % 5 == 0
    is_closed = None if is_open and gap < 5e-11 else not is_open
    return Case(MultipatchSurface(tuple(pieces)), 1e-12, is_closed)


def _crowd(rng: Random, count: int, degree: int, gap: float) -> Array:
    """Knots in groups of at most `degree`, which are `gap` of the range apart within a group.

    All are less than 10^6 ranges from zero.
    """
    inner: list[float] = []
    left = count - degree - 1
    places = np.sort(rng.uniform(0.1, 0.9, max(left, 1))).tolist()
    while left:
        repeats = min(left, int(rng.integers(1, degree, endpoint=True)))
        inner += [places[left - 1] + k * gap for k in range(repeats)]
        left -= repeats
    knots = np.concatenate([np.zeros(degree + 1), np.sort(inner), np.ones(degree + 1)])
    moved: Array = (knots + rng.choice([0, 1, -1]) * 10.0 ** rng.integers(0, 6)) * rng.uniform(
        0.1, 9
    )
    return moved
