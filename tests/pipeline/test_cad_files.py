"""Plans of files of definitions: their memory is not above the plan, and limits are checked."""

import tracemalloc
from dataclasses import replace
from time import thread_time

import numpy as np
import pytest

from service.encoders.cad.format import DefinitionFormat
from service.encoders.cad.registry import DEFINITION_FORMATS, DEFINITIONS_BY_NAME
from service.errors import InvalidRequest, TooLarge
from service.pipeline.cad_files import BYTE_SECONDS, plan_cad_file
from service.pipeline.limits import DEFAULT_LIMITS
from service.surface.bspline import BsplineSurface
from service.surface.convert.nets import SizeLimits
from service.surface.convert.operations import Elevate, ToBezier, Untrim
from service.surface.convert.table import convert
from service.surface.examples.catalogue import find
from service.surface.group import GroupSurface
from service.surface.kinds import Surface
from service.surface.member import Member


def build_spline() -> BsplineSurface:
    x = np.arange(60.0)
    columns = np.broadcast_arrays(x[:, np.newaxis], x, np.sin(x))
    return BsplineSurface(np.stack(columns, axis=-1))


def build_group() -> GroupSurface:
    """Copies of a solid: some stretched, so that their bodies are written again."""
    gear = find("gear").surface()
    matrices = [np.diag([1.0, 1.0 + k / 8, 1.0, 1.0]) for k in range(3)]
    return GroupSurface(tuple(Member(gear, f"m{k}", None, m) for k, m in enumerate(matrices)))


SURFACES: dict[str, Surface] = {
    "teapot": find("utah-teapot").surface(),
    "gear": find("gear").surface(),
    "spline": build_spline(),
    "group": build_group(),
}


@pytest.mark.slow
@pytest.mark.parametrize("fmt", DEFINITION_FORMATS, ids=lambda fmt: fmt.name)
@pytest.mark.parametrize("name", SURFACES)
def test_the_work_takes_no_more_memory_than_planned(name: str, fmt: DefinitionFormat) -> None:
    surface = SURFACES[name]
    if surface.size().faces and not fmt.has_trims:
        with pytest.raises(InvalidRequest):
            plan_cad_file(surface, (), SizeLimits(), fmt)
        return
    work = plan_cad_file(surface, (), SizeLimits(), fmt)
    expected = work.run().content  # fills the caches
    tracemalloc.start()
    file = work.run()
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert bytes(file.content) == bytes(expected)
    assert len(file.content) < peak < work.cost.memory


def test_equal_members_take_the_time_of_one_and_of_the_bytes_that_are_allowed() -> None:
    """The bodies of equal members are written once; the bound of the bytes counts each of them."""
    gear = find("gear").surface()
    many = GroupSurface(tuple(Member(gear, f"m{k}") for k in range(200)))
    fmt = DEFINITIONS_BY_NAME["step"]
    one, all_members = (plan_cad_file(each, (), SizeLimits(), fmt) for each in (gear, many))
    sizes = (min(fmt.estimate(each.size()), DEFAULT_LIMITS.max_bytes) for each in (gear, many))
    one_bytes, all_bytes = sizes
    added = all_members.cost.seconds - one.cost.seconds
    assert added == pytest.approx(BYTE_SECONDS * (all_bytes - one_bytes))


def test_patches_that_meet_take_no_longer_than_planned() -> None:
    u, v = np.meshgrid(np.linspace(0, 6, 15), np.linspace(0, 6, 15), indexing="ij")
    net = np.stack([u, v, np.sin(u) * np.cos(v)], axis=-1)
    spline = BsplineSurface(net, (3, 3), ("clamped", "clamped"))
    patches = convert(spline, (ToBezier(),), SizeLimits())
    for fmt in DEFINITION_FORMATS:
        work = plan_cad_file(patches, (), SizeLimits(), fmt)
        start = thread_time()
        work.run()
        assert thread_time() - start < 3 * work.cost.seconds


@pytest.mark.parametrize("fmt", DEFINITION_FORMATS, ids=lambda fmt: fmt.name)
def test_results_of_operations_are_checked_too(fmt: DefinitionFormat) -> None:
    limits = replace(DEFAULT_LIMITS, max_bytes=100_000)
    surface = find("utah-teapot").surface()
    assert plan_cad_file(surface, (Elevate((4, 4)),), SizeLimits(), fmt).run().content
    with pytest.raises(TooLarge) as caught:
        plan_cad_file(surface, (Elevate((20, 20)),), SizeLimits(), fmt, limits).run()
    (issue,) = caught.value.issues
    assert (issue.code, issue.pointer) == ("too_many_bytes", "/operations")


def test_kinds_are_checked_after_operations() -> None:
    vtu = DEFINITIONS_BY_NAME["vtu"]
    assert plan_cad_file(find("gear").surface(), (Untrim(0),), SizeLimits(), vtu).run().content
    with pytest.raises(InvalidRequest) as caught:
        plan_cad_file(find("ribbon").surface(), (), SizeLimits(), vtu)
    assert caught.value.issues[0].code == "not_parametric"
