"""Operations on groups, and on one patch of several: others stay, and points stay in place."""

import json
from dataclasses import replace
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from service.encoders.text import json_document
from service.engine.numbering import Numbering
from service.engine.points.places import PointsQuery
from service.errors import InvalidRequest, TooLarge
from service.pipeline.queries import plan_points
from service.schemas.request import SurfaceRequest
from service.schemas.surfaces import definition
from service.surface.convert.members import find_member
from service.surface.convert.nets import SizeLimits
from service.surface.convert.operations import (
    Elevate,
    Operation,
    Restrict,
    Reverse,
    Split,
    ToBezier,
    ToTriangle,
    Transpose,
    Untrim,
)
from service.surface.convert.table import convert
from service.surface.group import GroupSurface
from service.surface.kinds import Surface
from service.surface.member import Member
from service.surface.multipatch import MultipatchSurface
from service.surface.patches import PatchSurface
from service.surface.sweeps import TubeSurface
from tests.breps import PLATE
from tests.forms import SURFACES

MIRROR = np.array([[-1.0, 0.5, 0, 3], [0, 2, 0, 0], [0, 0, 1, -1], [0, 0, 0, 1]])
UV = np.array([[0.25, 0.5], [0.75, 0.125]])


def parse(document: Any) -> Any:
    """The surface of a document."""
    return SurfaceRequest.model_validate({"surface": document}).to_surface()


def write(surface: Surface) -> Any:
    """The document of a surface."""
    return json.loads(json_document(definition(surface)))


KINDS = {name: parse(SURFACES[name]) for name in ("bezier", "bspline")}
PATCHES: PatchSurface = parse(
    {
        "type": "patches",
        "vertices": [[i, j, (i * i + j) % 4 / 3] for i in range(4) for j in range(4)],
        "patches": [
            [[0, 1], [4, 5]],
            [[1, 2, 3], [5, 6, 7]],
            [[4, 5], [8, 9], [12, 13]],
        ],
        "triangles": [[[5, 6], [9]], [[6, 10], [9]]],
        "weights": [1, 2, 1, 3, 1, 1, 2, 1, 1, 1, 2, 1, 1, 3, 1, 1],
        "parts": {"corner": [0, 3], "wings": [1, 2]},
        "attributes": {"temperature": [[20 * k] for k in range(16)]},
    }
)


def build_group() -> GroupSurface:
    """A patch, a B-spline, patches, a multipatch; the second and the third are mirrored."""
    multipatch = MultipatchSurface(
        tuple(replace(KINDS[name], name=name) for name in ("bspline", "bezier", "bspline"))
    )
    return GroupSurface(
        (
            Member(KINDS["bezier"], "patch", (1.0, 0.0, 0.0)),
            Member(KINDS["bspline"], matrix=MIRROR),
            Member(name="frame", matrix=MIRROR),
            Member(PATCHES, "patches", matrix=MIRROR, parent=2),
            Member(multipatch, "many"),
        )
    )


def find_points(surface: Surface, patch: int, uv: Any = UV) -> Any:
    """Points of a patch, by its number."""
    query = PointsQuery(np.array(uv, float), np.array(patch), 0)
    return np.array(json.loads(plan_points(surface, query).run())["positions"])


def count(surface: Surface) -> int:
    """The number of all numbers of patches."""
    return len(Numbering.of(surface.lower()))


def test_numbers_are_those_of_points() -> None:
    group = build_group()
    numbering = Numbering.of(group.lower())
    placed = [number for number, member in enumerate(group.members) if member.surface is not None]
    copies, own = numbering.find_copies(np.arange(len(numbering)))
    found = [find_member(group, number) for number in range(len(numbering))]
    assert found == [(placed[copy], k) for copy, k in zip(copies, own.tolist(), strict=True)]


@pytest.mark.parametrize(
    "operation",
    [Elevate((5, 5)), Transpose(), Reverse("u"), ToBezier()],
    ids=lambda o: type(o).__name__,
)
def test_operations_on_all_members_keep_points_names_and_placements(operation: Operation) -> None:
    group = build_group()
    if isinstance(operation, Elevate):
        group = replace(group, members=(group.members[0], group.members[1]))
    converted = convert(group, [operation])
    assert isinstance(converted, GroupSurface)
    for old, new in zip(group.members, converted.members, strict=True):
        assert (old.full_name, old.color, old.parent) == (new.full_name, new.color, new.parent)
        assert (old.matrix is None) == (new.matrix is None)
    assert count(converted) == count(group)
    low, high = (np.array(ends) for ends in group.lower().bounds)
    if not isinstance(operation, Elevate):
        assert np.allclose(converted.lower().bounds, (low, high))


def list_chosen(patch: int) -> list[tuple[Operation, Any]]:
    """Operations on a patch; for points (u, v) of the new patch, those of the old one."""
    return [
        (Elevate((6, 7), patch), lambda uv: uv),
        (Transpose(patch), lambda uv: uv[:, ::-1]),
        (Reverse("u", patch), lambda uv: np.stack([1 - uv[:, 0], uv[:, 1]], axis=1)),
        (Restrict((0.25, 0.75), None, patch), lambda uv: uv * [0.5, 1] + [0.25, 0]),
        (ToBezier(patch), lambda uv: uv),
    ]


@pytest.mark.parametrize("number", range(3))
def test_one_patch_of_several_changes_alone(number: int) -> None:
    for operation, back in list_chosen(number):
        converted = convert(PATCHES, [operation])
        assert isinstance(converted, PatchSurface)
        assert count(converted) == count(PATCHES) == 5
        points = find_points(PATCHES, number, back(UV))
        assert np.allclose(find_points(converted, number), points)
        for k in range(3):
            if k != number:
                assert np.array_equal(find_points(converted, k), find_points(PATCHES, k))
        assert converted.parts == PATCHES.parts
        parse(write(converted))


def test_a_triangle_of_several_changes_alone() -> None:
    turned = convert(PATCHES, [Transpose(4)])
    place = np.array([[0.5, 0.3, 0.2]])
    points = find_points(PATCHES, 4, place[:, [0, 2, 1]])
    assert np.allclose(find_points(turned, 4, place), points)
    assert np.array_equal(find_points(turned, 3, place), find_points(PATCHES, 3, place))
    split = convert(PATCHES, [Split(at=(0.5, 0.25, 0.25), patch=3)])
    assert isinstance(split, PatchSurface)
    assert dict(split.parts) == {"corner": (0, 3, 4, 5), "wings": (1, 2)}
    assert np.array_equal(find_points(split, 6, place), find_points(PATCHES, 4, place))


def test_a_split_patch_has_its_pieces_in_its_place() -> None:
    patches = PATCHES
    converted = convert(patches, [Split(u=0.5, patch=0)])
    assert isinstance(converted, PatchSurface)
    assert len(converted.patches) == 4
    assert np.allclose(
        find_points(converted, 1, [[0.5, 0.5]]), find_points(patches, 0, [[0.75, 0.5]])
    )
    for k in range(1, len(patches.patches)):
        assert np.array_equal(find_points(converted, k + 1), find_points(patches, k))
    names = dict(patches.parts)
    for name, members in converted.parts:
        grown = len(members) - len(names[name])
        assert grown == (1 if 0 in names[name] else 0)
    used = np.concatenate([np.ravel(grid) for grid in converted.patches])
    used = np.append(used, converted.triangles.ravel())
    assert set(used.tolist()) == set(range(len(converted.vertices)))


def test_half_a_patch_is_the_first_of_the_triangles() -> None:
    document = {
        "type": "patches",
        "vertices": [[0, 0, 0], [0, 1, 1], [1, 0, 1], [1, 1, 0], [2, 0, 0], [2, 1, 0]],
        "patches": [[[0, 1], [2, 3]], [[2, 3], [4, 5]]],
        "parts": {"left": [0], "right": [1]},
    }
    patches = parse(document)
    converted = convert(patches, [ToTriangle("lower", 0)])
    assert isinstance(converted, PatchSurface)
    assert (len(converted.patches), len(converted.triangles)) == (1, 1)
    assert dict(converted.parts) == {"right": (0,), "left": (1,)}
    assert np.array_equal(find_points(converted, 0), find_points(patches, 1))
    place = [[0.5, 0.25, 0.25]]
    assert find_points(converted, 1, place) == pytest.approx(
        find_points(patches, 0, [[0.25, 0.25]])
    )
    with pytest.raises(InvalidRequest) as refused:
        convert(converted, [Elevate((2, 2)), ToTriangle("lower", 0)])
    assert refused.value.issues[0].code == "unsupported_operation"


def test_members_are_chosen_by_the_number_of_a_patch() -> None:
    group = build_group()
    starts = Numbering.of(group.lower()).starts.tolist()
    for place, (start, end) in enumerate(pairwise(starts)):
        member = [0, 1, 3, 4][place]
        for number in (start, end - 1):
            converted = convert(group, [Transpose(number)])
            assert isinstance(converted, GroupSurface)
            changed = [
                k
                for k, (old, new) in enumerate(zip(group.members, converted.members, strict=True))
                if old.surface is not new.surface
            ]
            assert changed == [member]
            if place == 0 or (place == 2 and number == start):  # a patch with u and v
                points = find_points(converted, number)
                assert np.allclose(points, find_points(group, number, UV[:, ::-1]))


def test_the_pieces_of_a_spline_are_a_multipatch_in_its_member() -> None:
    group = build_group()
    converted = convert(group, [Split(u=0.5, patch=1)])
    assert isinstance(converted, GroupSurface)
    pieces = converted.members[1].surface
    assert isinstance(pieces, MultipatchSurface)
    assert len(pieces.surfaces) == 2
    assert converted.members[1].full_name == group.members[1].full_name
    again = convert(converted, [Restrict(u=(0, 0.25), patch=1), Reverse("v")])
    assert isinstance(again, GroupSurface)


def test_results_of_conversions_are_converted_again() -> None:
    spline = KINDS["bspline"]
    group = convert(spline, [Split(u=0.5, v=0.25), Transpose(), Elevate((5, 5)), Reverse("u", 0)])
    assert isinstance(group, GroupSurface)
    assert len(group.members) == 4
    parse(write(group))
    patches = convert(group, [ToBezier(), Split(u=0.5, patch=1), Restrict(v=(0, 0.5), patch=0)])
    assert isinstance(patches, GroupSurface)
    parse(write(patches))
    alone = GroupSurface((Member(KINDS["bezier"], "one"),))
    for operation in (Split(u=0.5), Split(u=0.5, patch=0), ToTriangle("upper"), Restrict((0, 0.5))):
        assert isinstance(convert(alone, [operation]), GroupSurface)


def find_issue(surface: Surface, *operations: Operation) -> tuple[str, str]:
    """The code and the pointer of the refusal."""
    with pytest.raises(InvalidRequest) as refused:
        convert(surface, operations)
    issue = refused.value.issues[0]
    return issue.code, issue.pointer


def test_patches_that_do_not_exist_are_refused() -> None:
    group = build_group()
    last = count(group)
    assert find_issue(group, Split(u=0.5)) == ("missing_field", "/operations/0/patch")
    assert find_issue(group, Transpose(last)) == ("index_out_of_range", "/operations/0/patch")
    chosen = Transpose(0)
    assert find_issue(KINDS["bezier"], chosen) == ("unexpected_patch", "/operations/0/patch")
    assert find_issue(PATCHES, Transpose(1000)) == ("index_out_of_range", "/operations/0/patch")
    curve = parse(SURFACES["tube"])
    assert isinstance(curve, TubeSurface)
    with_tube = GroupSurface((Member(curve), Member(KINDS["bezier"])))
    assert find_issue(with_tube, Transpose()) == ("not_parametric", "/operations/0")
    assert isinstance(convert(with_tube, [Transpose(0)]), GroupSurface)
    assert find_issue(group, Untrim(patch=0)) == ("unsupported_operation", "/operations/0/patch")


def test_the_limit_counts_all_members() -> None:
    group = GroupSurface((Member(KINDS["bezier"], "a"), Member(KINDS["bspline"], "b")))
    points = [each.size().net_points for each in (KINDS["bezier"], KINDS["bspline"])]
    convert(group, [Transpose()], SizeLimits(sum(points)))
    for operation in (Transpose(), Elevate((5, 5), 0)):
        with pytest.raises(TooLarge):
            convert(group, [operation], SizeLimits(sum(points) - 1))


def test_faces_are_taken_by_their_number_among_all_patches() -> None:
    brep = parse(PLATE)
    group = GroupSurface((Member(KINDS["bezier"], "a"), Member(brep, "b")))
    face = write(convert(brep, [Untrim(0)]))
    assert write(convert(group, [Untrim(patch=1)])) == face
    assert write(convert(brep, [Untrim(patch=0)])) == face
    with pytest.raises(InvalidRequest):
        Untrim(0, None, 0)
