"""Groups: members with equal surfaces share a model, and members are turned upright."""

import numpy as np
import pytest
from hypothesis import given

from service.errors import InvalidRequest
from service.schemas.request import SurfaceRequest
from service.schemas.validation import validate_document
from service.surface.bezier import BezierSurface
from service.surface.checks import MAX_COORDINATE
from service.surface.content_key import content_key
from service.surface.examples.catalogue import find
from service.surface.group import MAX_MEMBERS, GroupSurface
from service.surface.lowered import PatchModel
from service.surface.member import Member
from service.surface.placement import place_box, turn_upright
from tests import breps
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


PLATE = validate_document(SurfaceRequest, {"surface": breps.PLATE}).to_surface()


def build_shift(x: float) -> Array:
    """The matrix (4, 4) of a translation along x."""
    matrix = np.eye(4)
    matrix[0, 3] = x
    return matrix


def test_parents_multiply_placements_and_lend_their_colours() -> None:
    """The nearest colour above counts; names become paths."""
    red, blue = (1.0, 0.0, 0.0, 1.0), (0.0, 0.0, 1.0, 0.5)
    group = GroupSurface(
        (
            Member(name="machine", color=red[:3], matrix=build_shift(10)),
            Member(SAIL, "sail", matrix=build_scaling(-2, 1, 1), parent=0),
            Member(SAIL, "jib", blue, parent=1),
            Member(None, parent=2),
            Member(SAIL, parent=3, matrix=build_shift(1)),
        )
    )
    model = group.lower()
    assert [each.name for each in model.members] == [
        "machine/sail",
        "machine/sail/jib",
        "machine/sail/jib/assembly/surface",
    ]
    assert [each.color for each in model.members] == [red, blue, blue]
    sail, jib, last = (each.matrix for each in model.members)
    assert sail is not None
    assert jib is not None
    assert last is not None
    assert sail.tolist() == jib.tolist() == (build_shift(10) @ build_scaling(-2, 1, 1)).tolist()
    assert last[0, 3] == 8
    assert [each.chain is not None for each in model.members] == [True, True, True]
    assert [(n.name, n.parent, n.copy) for n in model.nodes] == [
        ("machine", None, None),
        ("sail", 0, 0),
        ("jib", 1, 1),
        ("assembly", 2, None),
        ("surface", 3, 2),
    ]
    assert group.size().members == 3


def test_the_turn_of_a_surface_is_its_own() -> None:
    """A surface with another vertical axis is turned; the members below it are not."""
    upright = BezierSurface(NET, up="z")
    group = GroupSurface((Member(upright), Member(SAIL, parent=0, matrix=build_shift(3))))
    model = group.lower()
    first, second = (each.matrix for each in model.members)
    turn = turn_upright(None, "z", "y")
    assert turn is not None
    assert first is not None
    assert second is not None
    assert first.tolist() == turn.tolist()
    assert second.tolist() == build_shift(3).tolist()
    # The turn has a node of its own, below that of the member.
    assert [(n.parent, n.copy) for n in model.nodes] == [(None, None), (0, 0), (0, 1)]
    alone = GroupSurface((Member(), Member(upright, parent=0))).lower()
    assert [(n.parent, n.copy) for n in alone.nodes] == [(None, None), (0, 0)]
    assert alone.nodes[1].matrix is not None


@pytest.mark.parametrize(
    ("members", "has_definitions"),
    [
        ((Member(SAIL),), False),
        ((Member(SAIL), Member(SAIL, matrix=build_shift(1))), False),
        ((Member(SAIL), Member()), True),
        ((Member(SAIL), Member(SAIL, parent=0)), True),
        ((Member(PLATE),), True),
        ((Member(SAIL),) * MAX_MEMBERS, False),
        ((Member(SAIL),) * (MAX_MEMBERS + 1), True),
    ],
)
def test_groups_with_definitions(members: tuple[Member, ...], has_definitions: bool) -> None:
    group = GroupSurface(members)
    assert group.has_definitions is has_definitions
    assert len(group.definitions) == has_definitions


def test_surfaces_that_differ_in_their_names_become_one_definition() -> None:
    """The member keeps the name; a surface with another `up` is another definition."""
    other = BezierSurface(NET.copy(), name="other")
    upright = BezierSurface(NET, up="z")
    group = GroupSurface((Member(SAIL), Member(other, parent=0), Member(upright), Member(other)))
    assert group.definitions == (SAIL, upright)
    assert [each.name for each in group.members] == [None, "other", None, "other"]
    assert [each.surface for each in group.members] == [SAIL, SAIL, upright, SAIL]
    assert [each.model for each in group.lower().members] == [0, 0, 0, 0]


def test_a_group_has_a_surface() -> None:
    with pytest.raises(InvalidRequest) as caught:
        GroupSurface((Member(), Member(parent=0)))
    assert caught.value.issues[0].pointer == "/members/0/surface"


def test_paths_are_limited() -> None:
    """100 levels of names of 100 letters, many times, would be hundreds of megabytes."""
    names = [Member(name="x" * 100, parent=k - 1 if k else None) for k in range(99)]
    leaves = [Member(SAIL, "y" * 100, parent=98)] * 4000
    with pytest.raises(InvalidRequest) as caught:
        GroupSurface((*names, *leaves))
    assert caught.value.issues[0].code == "wrong_length"


def test_pointers_lead_to_the_request() -> None:
    """To the member, or to the definition that it names."""
    other = BezierSurface(2 * NET)
    third = BezierSurface(3 * NET)
    group = GroupSurface(
        (Member(), Member(SAIL), Member(other, definition=7), Member(other), Member(third))
    )
    model = group.lower()
    assert [model.locate(k) for k in range(3)] == [
        "/members/1/surface", "/definitions/7", "/members/4/surface"
    ]  # fmt: skip


def test_units_are_checked() -> None:
    for metres in (0.0, -1.0, 2e6, float("nan"), float("inf")):
        with pytest.raises(InvalidRequest) as caught:
            GroupSurface((Member(SAIL),), metres_per_unit=metres)
        assert caught.value.issues[0].pointer == "/metres_per_unit"


def test_coordinates_are_checked_after_placements() -> None:
    """As large as float32 allows; and a surface that is not placed anew is never refused."""
    low = -3.210089783317097e38  # the rounded half of its box is too large
    net = np.array([[[low, 0, 0], [low, 1, 0]], [[MAX_COORDINATE, 0, 0], [MAX_COORDINATE, 1, 0]]])
    largest = BezierSurface(net)
    low_corner, _ = GroupSurface((Member(SAIL), Member(largest))).lower().bounds
    assert low_corner[0] == low
    with pytest.raises(InvalidRequest) as caught:
        GroupSurface((Member(), Member(SAIL), Member(largest, matrix=build_shift(1e30))))
    issue = caught.value.issues[0]
    assert (issue.code, issue.pointer) == ("coordinate_too_large", "/members/2/matrix")
