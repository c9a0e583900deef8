"""A layout takes no more memory in the cache than it says."""

import pytest

from service.bases.arrays import AnyArray
from service.engine.connectivity.connect import connect
from service.engine.plans.layout import Layout
from tools.examples import lower_patches


@pytest.mark.parametrize("name", ["utah-teapot", "torus", "sphere", "saddle"])
@pytest.mark.parametrize("resolution", [(1, 1), (4, 4), (2, 7), (20, 20)])
def test_a_layout_takes_no_more_memory_than_it_says(name: str, resolution: tuple[int, int]) -> None:
    layout = Layout.build(connect(lower_patches(name)).connectivity, resolution)
    writes, averages = layout.border_writes, layout.averages
    arrays: list[AnyArray | None] = [layout.base, layout.ru, layout.rv, layout.divisions]
    arrays += [*averages.arrays, writes.targets, writes.sources, layout.pinched_sides]
    arrays += [patches for _, patches in layout.shapes] + [is_in for _, is_in in writes.groups]
    if layout.is_stitched:
        arrays += [layout.first_extra, layout.extra_count]
    used = sum(array.nbytes for array in arrays if array is not None)
    assert used + layout.connectivity.nbytes <= layout.nbytes
