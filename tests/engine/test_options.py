"""What may be asked of the engine."""

from dataclasses import FrozenInstanceError
from math import inf, nan, pi, radians

import pytest

from service.engine.options import MAX_RESOLUTION, MeshOptions
from service.errors import InvalidRequest


def test_defaults_are_the_documented_ones() -> None:
    """Sixteen divisions, triangles with normals, welded, creases above one degree."""
    options = MeshOptions()
    assert options.resolution == (16, 16)
    assert (options.faces, options.normals, options.uvs, options.weld) == (
        "triangles",
        True,
        False,
        True,
    )
    assert options.crease_angle == radians(1)
    assert options.overlays == ()


def test_is_frozen() -> None:
    """And hashable, so that it may be part of a key."""
    with pytest.raises(FrozenInstanceError):
        setattr(MeshOptions(), "weld", False)  # noqa: B010 - mypy refuses the plain assignment
    assert hash(MeshOptions()) == hash(MeshOptions())


@pytest.mark.parametrize("resolution", [(0, 1), (1, 0), (-3, 4), (4, MAX_RESOLUTION + 1)])
def test_refuses_resolutions_that_are_none(resolution: tuple[int, int]) -> None:
    """With the field's pointer, what was got and what is needed."""
    with pytest.raises(InvalidRequest) as caught:
        MeshOptions(resolution=resolution)
    (issue,) = caught.value.issues
    assert (issue.code, issue.pointer) == ("out_of_range", "/resolution")
    assert str(resolution[0]) in issue.got
    assert str(MAX_RESOLUTION) in issue.needed


@pytest.mark.parametrize("angle", [-0.1, 3.2, inf, nan])
def test_refuses_crease_angles_that_are_none(angle: float) -> None:
    """From 0 to π."""
    with pytest.raises(InvalidRequest) as caught:
        MeshOptions(crease_angle=angle)
    assert caught.value.issues[0].pointer == "/crease_angle"


def test_accepts_the_ends_of_the_ranges() -> None:
    """One division, the most divisions, no crease at all, nothing but creases."""
    MeshOptions(resolution=(1, MAX_RESOLUTION), crease_angle=0)
    MeshOptions(crease_angle=pi)
