"""Options of meshes: valid and invalid values."""

from dataclasses import FrozenInstanceError
from math import inf, nan, pi, radians
from typing import Any

import pytest

from service.engine.options import MAX_RESOLUTION, MeshOptions
from service.errors import InvalidRequest


def test_options_have_the_documented_defaults() -> None:
    """16 divisions, welded triangles with normals, and creases above 1 degree."""
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


def test_options_are_frozen_and_hashable() -> None:
    """Options must be hashable because they are part of keys of caches."""
    with pytest.raises(FrozenInstanceError):
        setattr(MeshOptions(), "weld", False)  # noqa: B010 - mypy refuses the plain assignment
    assert hash(MeshOptions()) == hash(MeshOptions())


@pytest.mark.parametrize(
    ("options", "pointer"),
    [
        *(({"resolution": n}, "/resolution") for n in ((0, 1), (1, 0), (-3, 4))),
        ({"resolution": (4, MAX_RESOLUTION + 1)}, "/resolution"),
        *(({"crease_angle": angle}, "/crease_angle") for angle in (-0.1, 3.2, inf, nan)),
        *(({"weld_tolerance": share}, "/weld_tolerance") for share in (-1e-20, 1.1e-6, nan)),
        ({"isocurves": (-1, 0)}, "/isocurves"),
        ({"isocurves": (0, 1025)}, "/isocurves"),
        ({"wire_width": 0.0}, "/wire_width"),
        ({"wire_width": nan}, "/wire_width"),
        ({"wire_sides": 2}, "/wire_sides"),
        ({"has_faces": False}, "/faces"),  # without isocurves or overlays, nothing is left
    ],
)
def test_invalid_options_are_refused(options: dict[str, Any], pointer: str) -> None:
    with pytest.raises(InvalidRequest) as caught:
        MeshOptions(**options)
    (issue,) = caught.value.issues
    assert issue.pointer == pointer
    assert issue.got
    assert issue.needed


def test_the_ends_of_the_ranges_are_accepted() -> None:
    """1 division and the largest number of divisions; crease angles of 0 and π."""
    MeshOptions(resolution=(1, MAX_RESOLUTION), crease_angle=0)
    MeshOptions(crease_angle=pi)
