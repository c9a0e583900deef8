"""Pairs of boxes that meet, against all pairs."""

import numpy as np
import pytest

from service.bases.arrays import Ints
from service.engine.brep.borders import box_pairs
from service.engine.brep.borders.box_pairs import BoxTree


def _find_all(a: tuple[Ints, Ints, Ints], b: tuple[Ints, Ints, Ints]) -> set[tuple[int, int]]:
    meets = a[0][:, None] == b[0]
    for axis in range(2):
        meets &= a[1][:, None, axis] <= b[2][:, axis]
        meets &= b[1][:, axis] <= a[2][:, None, axis]
    return set(zip(*(rows.tolist() for rows in meets.nonzero()), strict=True))


def _make_boxes(seed: int, count: int, spread: int) -> tuple[Ints, Ints, Ints]:
    rng = np.random.default_rng(seed)
    low = rng.integers(0, 1 << 30, (count, 2)) // spread * spread
    sizes = (rng.random((count, 2)) ** 8 * (1 << 30)).astype(np.int64) // spread * spread
    return rng.integers(0, 3, count), low, np.minimum(low + sizes, 1 << 30)


@pytest.mark.parametrize("count", [0, 1, 2, 5, 130])
@pytest.mark.parametrize("spread", [1, 1 << 27])
@pytest.mark.parametrize(("few", "pairs"), [(0, 1 << 17), (64, 1 << 17), (64, 50)])
def test_all_pairs_that_meet_are_found_once(
    count: int, spread: int, few: int, pairs: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(box_pairs, "FEW", few)
    monkeypatch.setattr(box_pairs, "PAIRS", pairs)
    boxes, others = _make_boxes(count, count, spread), _make_boxes(count + 1, 40, spread)
    tree = BoxTree.of(*boxes)
    first, second = tree.find_pairs(*others)
    found = list(zip(first.tolist(), second.tolist(), strict=True))
    assert len(found) == len(set(found))
    assert set(found) == _find_all(others, boxes)
    assert (np.diff(first) >= 0).all()
    lists = [np.stack(pairs, axis=1) for pairs in tree.list_own_pairs()]
    own = [(min(pair), max(pair)) for pairs in lists for pair in pairs.tolist()]
    assert len(own) == len(set(own))
    assert set(own) == {pair for pair in _find_all(boxes, boxes) if pair[0] < pair[1]}


def test_the_number_of_steps_does_not_grow_with_the_square(monkeypatch: pytest.MonkeyPatch) -> None:
    """A plate with 10,000 long slots, and one with 10,000 round holes."""
    tests = []
    keep = box_pairs._keep_meeting

    def count_tests(boxes: Ints, others: Ints, box: Ints, other: Ints) -> tuple[Ints, Ints]:
        tests.append(len(box))
        return keep(boxes, others, box, other)

    monkeypatch.setattr(box_pairs, "_keep_meeting", count_tests)
    rows = np.arange(10_000) * 100_000
    slots = np.stack([np.full(10_000, 5), rows], 1), np.stack([np.full(10_000, 1 << 29), rows], 1)
    x, y = np.divmod(np.arange(10_000), 100)
    centers = np.stack([x, y], axis=1) * 10_000_000
    for low, high in (slots, (centers, centers + 5_000_000)):
        tree = BoxTree.of(np.zeros(10_000, int), low, high)
        tests.clear()
        assert not any(len(first) for first, _ in tree.list_own_pairs())
        assert sum(tests) < 100 * 10_000
