"""Requests for groups: definitions, members that name them, and members that place others."""

from typing import Any

import pytest

from service.errors import InvalidRequest
from service.schemas.document import DocumentLimits
from service.schemas.request import SurfaceRequest
from service.schemas.validation import validate_document
from service.surface.group import GroupSurface
from tests.breps import PLATE
from tests.forms import PATCH, SURFACES, TENT

LIMITS = DocumentLimits()


def read(limits: DocumentLimits = LIMITS, **fields: Any) -> GroupSurface:
    """The group with these fields."""
    document = {"surface": {"type": "group", **fields}}
    surface = validate_document(SurfaceRequest, document, limits).to_surface()
    assert isinstance(surface, GroupSurface)
    return surface


def refuse(limits: DocumentLimits = LIMITS, **fields: Any) -> tuple[str, str]:
    """Code and pointer, in the group, of the first error."""
    with pytest.raises(InvalidRequest) as caught:
        read(limits, **fields)
    issue = caught.value.issues[0]
    return issue.code, issue.pointer.removeprefix("/surface")


def test_members_name_definitions() -> None:
    """Members share one value; a definition that no member names is left out."""
    group = read(
        definitions=[TENT, PATCH, TENT | {"name": "tent"}],
        members=[{"name": "ship"}, {"definition": 1, "parent": 0}, {"definition": 2, "parent": 0}],
    )
    assert len(group.definitions) == 2
    assert group.members[1].surface is group.definitions[0]
    assert group.members[2].full_name == "tent"


@pytest.mark.parametrize(
    ("members", "code", "where"),
    [
        ([{"definition": 1}], "unknown_definition", "/members/0/definition"),
        ([{"definition": -1}], "unknown_definition", "/members/0/definition"),
        ([{"definition": 2**60}], "index_out_of_range", "/members/0/definition"),
        ([{"definition": 0.5}], "wrong_type", "/members/0/definition"),
        ([{"definition": 0, "surface": PATCH}], "conflicting_options", "/members/0/definition"),
        ([{"definition": 0, "parent": 0}], "unknown_parent", "/members/0/parent"),
        ([{}, {"definition": 0, "parent": 1}], "unknown_parent", "/members/1/parent"),
        ([{"definition": 0, "parent": None}], "null_value", "/members/0/parent"),
        ([{"name": "empty"}], "missing_field", "/members/0/surface"),
        ([{"definition": 0, "matrix": [[1]]}], "wrong_dimension", "/members/0/matrix"),
        ([], "wrong_length", "/members"),
    ],
)  # fmt: skip
def test_wrong_members(members: list[Any], code: str, where: str) -> None:
    assert refuse(definitions=[PATCH], members=members) == (code, where)


@pytest.mark.parametrize(
    ("definition", "code", "where"),
    [
        ({"type": "group", "members": []}, "nested_group", "/definitions/0/type"),
        ({"type": "mesh"}, "unknown_type", "/definitions/0/type"),
        ({"control_net": [[[0, 0, 0]]]}, "too_few_points", "/definitions/0/control_net"),
        (PLATE | {"faces": []}, "wrong_length", "/definitions/0/faces"),
        (PLATE | {"edges": [{"vertices": [0, 99]}]}, "unknown_vertex", "/definitions/0/edges/0"),
    ],
)  # fmt: skip
def test_wrong_definitions(definition: Any, code: str, where: str) -> None:
    """The pointer leads to the definition, also if several members name it."""
    members = [{"definition": 0}, {"definition": 0}]
    found, pointer = refuse(definitions=[definition], members=members)
    assert (found, pointer[: len(where)]) == (code, where)


def test_limits_of_members_and_surfaces() -> None:
    """A group may have 16 times as many members as surfaces."""
    limits = DocumentLimits(max_members=2)
    placed = {"definition": 0, "parent": 0}
    assert len(read(limits, definitions=[PATCH], members=[{}, *[placed] * 31]).members) == 32
    assert refuse(limits, definitions=[PATCH], members=[{}, *[placed] * 32]) == (
        "wrong_length", "/members"
    )  # fmt: skip
    own = {"surface": PATCH}
    assert refuse(limits, members=[own] * 3) == ("wrong_length", "/members")
    assert refuse(limits, definitions=[PATCH] * 3, members=[placed | {"parent": 0}]) == (
        "wrong_length", "/definitions"
    )  # fmt: skip


def test_a_definition_counts_once_if_it_is_stored_once() -> None:
    """`PATCH` has 6 points. Without parents and breps each member is stored with its surface."""
    limits = DocumentLimits(max_control_points=12)
    copies = [{"definition": 0}] * 3
    assert refuse(limits, definitions=[PATCH], members=copies) == (
        "too_many_control_points", "/members"
    )  # fmt: skip
    assert len(read(limits, definitions=[PATCH], members=[{}, *copies]).members) == 4
    limits = DocumentLimits(max_faces=2)
    assert len(read(limits, definitions=[PLATE], members=copies).members) == 3
    three = [{"definition": k} for k in range(3)]
    assert refuse(limits, definitions=[PLATE] * 3, members=three) == ("too_many_faces", "/members")


@pytest.mark.parametrize("metres", [0, -1, 1e7, "mm", None])
def test_wrong_units(metres: Any) -> None:
    code, where = refuse(members=[{"surface": PATCH}], metres_per_unit=metres)
    assert where == "/metres_per_unit"
    assert code in ("out_of_range", "wrong_type", "null_value")


def test_the_unit_of_a_member_has_no_effect() -> None:
    group = read(members=[{"surface": PLATE | {"metres_per_unit": 0.5}}, {"surface": PLATE}])
    assert len(group.definitions) == 1
    assert group.unit is None
    assert read(members=[{"surface": PATCH}], metres_per_unit=1e-3).unit == 1e-3


def test_members_may_have_patches_of_several_degrees() -> None:
    """Their indices count: 4 + 6 + 4."""
    ragged = SURFACES["patches of several degrees"]
    own = {"surface": ragged}
    assert len(read(members=[own]).members) == 1
    group = read(definitions=[ragged], members=[{}, {"definition": 0, "parent": 0}])
    assert len(group.members) == 2
    assert read(DocumentLimits(max_control_points=28), members=[own, own]).members
    assert refuse(DocumentLimits(max_control_points=27), members=[own, own]) == (
        "too_many_control_points", "/members"
    )  # fmt: skip
