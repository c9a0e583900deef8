"""Places where rays pass edges, compared with samples of the edges."""

import numpy as np
import pytest
from hypothesis import given

from oracles.sheets import Array
from oracles.solids import read_solid
from service.bases.arrays import Bools, Ints
from service.engine.cells.tree import WorkLimits
from service.engine.nets.nets import group_nets
from service.engine.nets.query_nets import UNIT_CORNERS, QueryNets
from service.engine.parts.border_nets import BorderNets, BorderSides, build_border_nets
from service.engine.parts.build import build_part
from service.engine.rays.bounds import make_rays
from service.engine.rays.edge_search import EdgePasses, EdgeSearch
from service.engine.rays.intersect import CHUNK_SIZES, LIMITS
from tests.engine.brep.solid_documents import lower
from tests.engine.trims.tables import seeds

THICKNESS = 1e-9


def find_passes(
    borders: BorderNets, reach: Array, origins: Array, directions: Array,
    limits: WorkLimits = LIMITS,
) -> tuple[EdgePasses, Bools]:  # fmt: skip
    search = EdgeSearch(borders.nets, borders.item, reach, limits, CHUNK_SIZES)
    return search.find(make_rays(origins, directions, THICKNESS, 0.0))


def sample(nets: QueryNets, item: Ints, shares: Array) -> tuple[Array, Ints]:
    """Points (n, 3) of all nets, and their items."""
    points = []
    owners = []
    for group in nets.groups:
        degree = group.degree[0]
        k = np.arange(degree + 1)
        binomial = np.array([np.prod([(degree - j) / (j + 1) for j in range(i)]) for i in k])
        basis = binomial * shares[:, np.newaxis] ** k * (1 - shares[:, np.newaxis]) ** (degree - k)
        curves = np.einsum("si,idk->ksd", basis, group.values[:, 0])
        if group.is_rational:
            curves = curves[..., :3] / curves[..., 3:]
        points.append(curves.reshape(-1, 3))
        number = group.first + np.arange(len(group.patches))
        owners.append(np.repeat(item[number], len(shares)))
    return np.concatenate(points), np.concatenate(owners)


@pytest.mark.slow
@pytest.mark.parametrize("name", ["wavy", "spring"])
@given(seeds)
def test_passes_are_where_samples_of_edges_are_near(name: str, seed: int) -> None:
    if name not in _BORDERS:
        borders = build_border_nets(build_part(lower(read_solid(name))))
        assert borders is not None
        _BORDERS[name] = borders
    borders = _BORDERS[name]
    rng = np.random.default_rng(seed)
    points, owners = sample(borders.nets, borders.item, np.linspace(0, 1, 200))
    reach = np.full(len(borders.item), rng.choice([1e-6, 1e-3, 0.05]))
    count = 40
    targets = points[rng.integers(0, len(points), count)]
    directions = rng.normal(size=(count, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, np.newaxis]
    across = np.cross(directions, rng.normal(size=(count, 3)))
    across /= np.linalg.norm(across, axis=1)[:, np.newaxis]
    share = rng.choice([0.0, 0.5, 0.999, 1.2, 3.0], count)
    origins = targets + across * (share * reach[0])[:, np.newaxis] - directions
    passes, reached = find_passes(borders, reach, origins, directions)
    assert reached.all()
    assert np.isin(np.flatnonzero(share < 1), passes.ray).all()
    assert (passes.distance <= 9 / 8 * (reach[0] + THICKNESS) + 1e-12).all()
    # Along the ray t is 0 at the point nearest to the middle of the nets.
    rays = make_rays(origins, directions, THICKNESS, 0.0)
    for k in range(count):
        from_origin = points - rays.origin[:, k]
        t = from_origin @ rays.direction[:, k]
        distance = np.linalg.norm(np.cross(from_origin, rays.direction[:, k]), axis=1)
        near = np.flatnonzero(distance < reach[0])
        rows = np.flatnonzero(passes.ray == k)
        covers = (passes.low[rows] <= t[near, np.newaxis]) & (
            t[near, np.newaxis] <= passes.high[rows]
        )
        covers &= borders.item[passes.net[rows]] == owners[near, np.newaxis]
        assert covers.any(axis=1).all()


def build_line(start: Array, end: Array) -> BorderNets:
    net = np.stack([start, end])[:, np.newaxis, :, np.newaxis]
    groups = group_nets([(np.zeros(1, np.intp), net)])
    item, corners = np.zeros(1, np.intp), UNIT_CORNERS[np.newaxis]
    nets = QueryNets(groups, np.zeros(3), 1.0, item, corners, 1.0)
    none, values = np.zeros(0, np.intp), np.zeros(0)
    sides = BorderSides(none, none, values, values)
    return BorderNets(nets, item, np.zeros(1), np.ones(1, bool), np.zeros(2, np.intp), sides)


@pytest.mark.parametrize("angle", [0.0, 1e-15, 1e-12, 1e-9, 1e-6, 1e-3, 0.1])
@pytest.mark.parametrize("reach", [0.0, 1e-6, 0.1])
def test_rays_nearly_along_an_edge_have_tight_intervals(angle: float, reach: float) -> None:
    line = build_line(np.array([-0.5, 0.1, 0.2]), np.array([0.25, 0.1, 0.2]))
    way = np.array([[np.cos(angle), np.sin(angle), 0]])
    through = np.array([[0.1, 0.1, 0.2]])
    passes, reached = find_passes(line, np.full(1, reach), through - 2 * way, way)
    assert reached.all()
    assert len(passes.ray) == 1
    rays = make_rays(through - 2 * way, way, THICKNESS, 0.0)
    low, high = passes.low[0] - rays.near[0] - 2, passes.high[0] - rays.near[0] - 2
    radius = reach + THICKNESS

    def is_near(t: float) -> bool:
        """Whether the point at t of the ray is within the radius; the edge is along x."""
        x, y, _ = t * way[0]
        aside = x - min(max(x, -0.6), 0.15)
        return bool(np.hypot(aside, y) <= radius)

    expected = []
    for sign in (-1.0, 1.0):
        near, far = 0.0, sign * 2.0
        for _ in range(60):
            middle = (near + far) / 2
            near, far = (middle, far) if is_near(middle) else (near, middle)
        expected.append(near)
    slack = 1.1 * radius + 1e-3 * (expected[1] - expected[0])
    assert low <= expected[0] + 1e-15 <= low + slack + 1e-12
    assert high - slack - 1e-12 <= expected[1] <= high + 1e-15


def test_the_work_for_passes_is_bounded() -> None:
    borders = build_border_nets(build_part(lower(read_solid("wavy"))))
    assert borders is not None
    points, _ = sample(borders.nets, borders.item, np.linspace(0, 1, 9))
    limits = WorkLimits(pairs=200, of_item=1000)
    ways = np.tile([0.3, 0.4, 0.5], (len(points), 1))
    _, reached = find_passes(borders, borders.reach, points - ways, ways, limits)
    assert not reached.all()


_BORDERS: dict[str, BorderNets] = {}
