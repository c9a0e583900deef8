"""Groups: members with equal surfaces share a model, and members are turned upright."""

import numpy as np
import pytest
from hypothesis import given

from service.surface.bezier import BezierSurface
from service.surface.examples.catalogue import find
from service.surface.group import GroupSurface, Member, content_key
from service.surface.lowered import PatchModel
from service.surface.placement import place_box, turn_upright
from tests.strategies import Array, placements

NET = np.array([[[0.0, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 1]]])
SAIL = BezierSurface(NET)


def build_scaling(x: float, y: float, z: float) -> Array:
    """The matrix (4, 4) that scales by these factors along the axes."""
    return np.diag([x, y, z, 1.0])


def test_members_with_equal_surfaces_share_a_model() -> None:
    """Surfaces are equal if all their values except name and `up` are.

    Name, `up`, colour and matrix belong to the member.
    """
    group = GroupSurface(
        (
            Member(SAIL),
            Member(BezierSurface(NET.copy(), name="other")),
            Member(BezierSurface(NET, up="z")),
            Member(BezierSurface(NET, np.ones((2, 2)))),
            Member(BezierSurface(NET.swapaxes(0, 1))),
            Member(BezierSurface(NET), "named", (1, 0, 0), build_scaling(-1, 1, 1)),
        )
    )
    model = group.lower()
    assert [member.model for member in model.members] == [0, 0, 0, 1, 2, 0]
    assert [member.name for member in model.members] == ["surface", "other"] + ["surface"] * 3 + [
        "named"
    ]
    assert model.members[5].color == (1.0, 0.0, 0.0, 1.0)
    assert model.patch_count == 6


def test_content_keys_are_equal_for_equal_values_only() -> None:
    zero = np.array([0.0, 1.0])
    assert content_key(zero) == content_key(zero.copy()) == content_key(np.array([-0.0, 1.0]))
    distinct = [zero, zero[::-1], zero.reshape(1, 2), zero.astype(int), (0.0, 1.0), None, SAIL]
    assert len({content_key(value) for value in distinct}) == len(distinct)
    assert content_key(find("sphere").surface()) != content_key(find("torus").surface())


@pytest.mark.parametrize("matrix", [None, build_scaling(2, 3, -4)])
def test_members_with_another_up_are_rotated_without_rounding(matrix: Array | None) -> None:
    """The vertical axis of the member becomes the vertical axis of the group."""
    point = np.array([0.1, 0.2, 0.3, 1.0])
    placement = np.eye(4) if matrix is None else matrix
    upright = turn_upright(matrix, "z", "y")
    assert upright is not None
    assert (upright @ point).tolist() == (placement @ [0.1, 0.3, -0.2, 1]).tolist()
    from_y_to_z = turn_upright(matrix, "y", "z")
    assert from_y_to_z is not None
    assert (from_y_to_z @ point).tolist() == (placement @ [0.1, -0.3, 0.2, 1]).tolist()
    assert turn_upright(upright, "y", "y") is upright
    assert turn_upright(np.eye(4), "z", "z") is None


@given(placements())
def test_bounds_after_a_map_contain_the_mapped_control_points(matrix: Array) -> None:
    model = find("tveit").surface().lower()
    assert isinstance(model, PatchModel)
    low, high = place_box(model.bounds, matrix)
    points = model.batches[0].points.reshape(-1, 3) @ matrix[:3, :3].T + matrix[:3, 3]
    assert (points >= low - 1e-12).all()
    assert (points <= high + 1e-12).all()
