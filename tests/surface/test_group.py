"""Groups: what is refused, what counts as equal, and how members are turned upright."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given

from service.errors import InvalidRequest
from service.surface.bezier import BezierSurface
from service.surface.examples import find
from service.surface.group import MAX_MEMBERS, GroupSurface, Member, content_key
from service.surface.lowered import PatchModel
from service.surface.placement import checked_matrix, placed_bounds, upright
from tests.strategies import Array, placements

NET = np.array([[[0.0, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 1]]])
SAIL = BezierSurface(NET)


def scaled(x: float, y: float, z: float) -> Array:
    return np.diag([x, y, z, 1.0])


def refusal_of(make: Callable[[], object]) -> tuple[str, str]:
    with pytest.raises(InvalidRequest) as caught:
        make()
    issue = caught.value.issues[0]
    assert issue.got
    assert issue.needed
    return issue.code, issue.pointer


def with_entry(row: int, column: int, value: float) -> Array:
    matrix = np.eye(4)
    matrix[row, column] = value
    return matrix


@pytest.mark.parametrize(
    ("matrix", "code", "pointer"),
    [
        (np.eye(3), "wrong_dimension", ""),
        (np.eye(4)[:3], "wrong_dimension", ""),
        (with_entry(1, 2, np.nan), "not_finite", "/1/2"),
        (with_entry(0, 3, np.inf), "not_finite", "/0/3"),
        (with_entry(2, 3, 1e308), "out_of_range", "/2/3"),
        (with_entry(3, 0, 1e-9), "not_affine", "/3"),
        (with_entry(3, 3, 2), "not_affine", "/3"),
        (scaled(1, 1, 0), "singular_matrix", ""),
        (scaled(0, 0, 0), "singular_matrix", ""),
        (scaled(1e7, 1, 1), "singular_matrix", ""),
        (scaled(1e-40, 1e-40, 1e-40), "singular_matrix", ""),
        ([[1, 2, 3, 0], [2, 4, 6, 0], [0, 0, 1, 0], [0, 0, 0, 1]], "singular_matrix", ""),
    ],
)
def test_placements_that_are_none(matrix: Any, code: str, pointer: str) -> None:
    assert refusal_of(lambda: checked_matrix(matrix)) == (code, pointer)
    where = "/matrix" + pointer
    assert refusal_of(lambda: Member(SAIL, matrix=matrix)) == (code, where)


@pytest.mark.parametrize(
    ("color", "code", "pointer"),
    [
        ((0.5, 0.5), "wrong_length", "/color"),
        ((0.5,) * 5, "wrong_length", "/color"),
        ((0, 1, 1.5), "out_of_range", "/color/2"),
        ((0, -0.1, 1), "out_of_range", "/color/1"),
        ((0, 0, 0, float("nan")), "out_of_range", "/color/3"),
    ],
)
def test_colors_that_are_none(color: tuple[float, ...], code: str, pointer: str) -> None:
    assert refusal_of(lambda: Member(SAIL, color=color)) == (code, pointer)


def test_a_group_has_members_but_no_groups() -> None:
    assert refusal_of(lambda: GroupSurface(())) == ("wrong_length", "/members")
    many = (Member(SAIL),) * (MAX_MEMBERS + 1)
    assert refusal_of(lambda: GroupSurface(many)) == ("wrong_length", "/members")
    inner = GroupSurface((Member(SAIL),))
    assert refusal_of(lambda: Member(inner)) == ("nested_group", "/surface/type")


def test_members_stay_within_single_precision() -> None:
    far = Member(BezierSurface(NET * 1e30), matrix=scaled(1e9, 1e9, 1e9))
    found = refusal_of(lambda: GroupSurface((Member(SAIL), far)))
    assert found == ("coordinate_too_large", "/members/1/matrix")


def test_equal_surfaces_are_one_model_whatever_they_are_called() -> None:
    """Equal in what they say, not in being the same object."""
    group = GroupSurface(
        (
            Member(SAIL),
            Member(BezierSurface(NET.copy(), name="other")),
            Member(BezierSurface(NET, up="z")),
            Member(BezierSurface(NET, np.ones((2, 2)))),
            Member(BezierSurface(NET.swapaxes(0, 1))),
            Member(BezierSurface(NET), "named", (1, 0, 0), scaled(-1, 1, 1)),
        )
    )
    model = group.lower()
    assert [member.model for member in model.members] == [0, 0, 0, 1, 2, 0]
    assert [member.name for member in model.members] == ["surface", "other"] + ["surface"] * 3 + [
        "named"
    ]
    assert model.members[5].color == (1.0, 0.0, 0.0, 1.0)
    assert model.patch_count == 6


def test_content_keys_are_of_values() -> None:
    zero = np.array([0.0, 1.0])
    assert content_key(zero) == content_key(-zero * -1) == content_key(np.array([-0.0, 1.0]))
    distinct = [zero, zero[::-1], zero.reshape(1, 2), zero.astype(int), (0.0, 1.0), None, SAIL]
    assert len({content_key(value) for value in distinct}) == len(distinct)
    assert content_key(find("sphere").surface()) != content_key(find("torus").surface())


@pytest.mark.parametrize("matrix", [None, scaled(2, 3, -4)])
def test_members_of_another_up_are_turned_upright_exactly(matrix: Array | None) -> None:
    """What pointed along the member's vertical axis points along the group's."""
    point = np.array([0.1, 0.2, 0.3, 1.0])
    place = np.eye(4) if matrix is None else matrix
    turned = upright(matrix, "z", "y")
    assert turned is not None
    assert (turned @ point).tolist() == (place @ [0.1, 0.3, -0.2, 1]).tolist()
    back = upright(matrix, "y", "z")
    assert back is not None
    assert (back @ point).tolist() == (place @ [0.1, -0.3, 0.2, 1]).tolist()
    assert upright(turned, "y", "y") is turned
    assert upright(np.eye(4), "z", "z") is None


@given(placements())
def test_placed_bounds_hold_the_placed_corners(matrix: Array) -> None:
    model = find("tveit").surface().lower()
    assert isinstance(model, PatchModel)
    low, high = placed_bounds(model.bounds, matrix)
    points = model.batches[0].points.reshape(-1, 3) @ matrix[:3, :3].T + matrix[:3, 3]
    assert (points >= low - 1e-12).all()
    assert (points <= high + 1e-12).all()
