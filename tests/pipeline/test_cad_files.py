"""Plans of files of definitions: their memory is not above the plan, and limits are checked."""

import tracemalloc
from dataclasses import replace

import numpy as np
import pytest

from service.encoders.cad.format import DefinitionFormat
from service.encoders.cad.registry import DEFINITION_FORMATS, DEFINITIONS_BY_NAME
from service.errors import InvalidRequest, TooLarge
from service.pipeline.cad_files import plan_cad_file
from service.pipeline.limits import DEFAULT_LIMITS
from service.surface.bspline import BsplineSurface
from service.surface.convert.nets import SizeLimits
from service.surface.convert.operations import Elevate, Untrim
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


def test_equal_members_add_little_to_the_time() -> None:
    """The bodies of equal members are written once."""
    gear = find("gear").surface()
    many = GroupSurface(tuple(Member(gear, f"m{k}") for k in range(200)))
    one, all_members = (
        plan_cad_file(each, (), SizeLimits(), DEFINITIONS_BY_NAME["step"]) for each in (gear, many)
    )
    assert all_members.cost.seconds < one.cost.seconds + 10


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
