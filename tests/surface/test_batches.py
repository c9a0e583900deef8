"""What batches know of their patches: bounds, sides of one point, and how they leave these."""

import numpy as np
import pytest

from service.surface.batches import TensorPatches
from service.surface.sides import along_sides, corners_of, side_of

COUNTS = (1, 2, 63, 64, 81)


def random_batch(count: int, seed: int = 0) -> TensorPatches:
    """Patches of degree (2, 3), of which some have sides, or all points, in one point."""
    rng = np.random.default_rng([seed, count])
    points = rng.uniform(-1, 1, (count, 3, 4, 3))
    points[::5, 0] = points[::5, :1, 0]
    points[1::5, :, -1] = points[1::5, 1:2, -1]
    points[2::5, -1] = points[2::5, -1:, 1]
    points[2::5, :, 0] = points[2::5, -1:, 0]
    points[3::5, 0, -1] = points[3::5, 0, 0]  # equal ends alone
    points[4::20] = points[4::20, :1, :1]
    return TensorPatches(points, rng.uniform(0.5, 2, points.shape[:3]))


@pytest.mark.parametrize("count", COUNTS)
def test_bounds_are_those_of_all_control_points(count: int) -> None:
    """Whether or not the patches fold into rows without a rest."""
    batch = random_batch(count)
    flat = batch.points.reshape(-1, 3)
    np.testing.assert_array_equal(batch.bounds, (flat.min(axis=0), flat.max(axis=0)))


@pytest.mark.parametrize("count", COUNTS)
def test_a_side_collapses_where_all_its_points_are_equal(count: int) -> None:
    """Equal ends are not enough."""
    batch = random_batch(count)
    sides = [side_of(batch.points, number) for number in range(4)]
    expected = np.stack([(s == s[:, :1]).all(axis=(1, 2)) for s in sides], axis=1)
    np.testing.assert_array_equal(batch.collapsed, expected)
    np.testing.assert_array_equal(batch.corners, corners_of(batch.points))


def test_cones_are_the_next_rows_seen_from_the_poles() -> None:
    """Times their weights, for each collapsed side once."""
    batch = random_batch(81)
    assert batch.weights is not None
    seen = set()
    for poles in batch.poles:
        for patch, end, cone in zip(poles.patches, poles.end, poles.cones, strict=True):
            side = 2 * poles.axis + int(end)
            seen.add((int(patch), side))
            pole = side_of(batch.points, side)[patch, 0]
            beside, weights = (
                side_of(net, side, 1)[patch] for net in (batch.points, batch.weights)
            )
            np.testing.assert_array_equal(cone, (beside - pole) * weights[:, None])
            assert len(cone) == along_sides(*batch.degree)[side] + 1
    assert seen == {tuple(place) for place in np.argwhere(batch.collapsed).tolist()}
