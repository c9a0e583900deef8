"""All JSON texts of a surface have one canonical content; other surfaces have other contents.

`python -m tests.storage.test_canonical` writes the golden ids, after a surface is added.
"""

import json
import math
from collections.abc import Iterator
from dataclasses import MISSING, fields
from hashlib import sha256
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
import orjson
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from service.bases.arrays import FloatArray
from service.errors import DamagedObject, InvalidRequest
from service.schemas.document import DocumentLimits, parse_document
from service.schemas.request import SurfaceRequest
from service.schemas.surfaces import definition
from service.schemas.validation import parse_request, validate_document
from service.storage.canonical import canonical_content, restore_surface, surface_id
from service.surface.bezier import BezierSurface
from service.surface.content_key import content_key
from service.surface.curve import BezierCurve, BsplineCurve
from service.surface.examples.catalogue import EXAMPLES, find
from service.surface.group import GroupSurface
from service.surface.kinds import Surface
from service.surface.member import Member
from tests.forms import ARC, PATCH, SURFACES, TENT, WAVES, Json
from tests.spellings import IDENTITY, spell_number, spell_surface

LIMITS = DocumentLimits()
IDS: Path = Path(__file__).parents[1] / "golden" / "ids.json"

SHIFTED = [[1, 0, 0, 2.5], [0, -1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]

UNUSUAL_SURFACES: dict[str, Json] = {
    "a spline with all defaults": {"type": "bspline", "control_net": WAVES},
    "a ribbon with the default direction": {
        "type": "ribbon",
        "curve": {
            "type": "bspline",
            "control_points": [point[:2] for point in ARC],
            "degree": 2,
            "knots": [-1, -1, -1, 0.25, 2, 2, 2],
            "weights": [1, 0.1, 1e-3, 2],
        },
        "width": 1 / 3,
        "name": "Sch\u00f6nes \U0001f380 /~",
    },
    "a tube of sixteen sides": {
        "type": "tube",
        "curve": {"control_points": ARC, "weights": [1, 2, 1, 1]},
        "radius": 0.1,
        "caps": False,
    },
    "numbers of all sizes": {
        "control_net": [
            [[0.1, 2**53 + 2, -1e-30], [5e-324, 1e38, 0]],
            [[1e22, 1, -0.0], [7, 8, 9]],
        ],
        "weights": [[1e-3, 0.7071067811865476], [123456789.123e-4, 3]],
        "up": "z",
        "name": "sizes",
    },
    "parts and attributes in unusual order": TENT
    | {
        "weights": [1, 2, 3, 4, 5],
        "parts": {"b": [1], "a": [0]},
        "attributes": {"sides": [[k] for k in range(5)], "Degree": [[k, 2] for k in range(5)]},
    },
    "members with all defaults": {
        "type": "group",
        "members": [
            {"surface": PATCH, "matrix": IDENTITY, "color": [0, 1, 0.5, 1], "name": "surface"},
            {"surface": TENT | {"name": "tent"}},
        ],
    },
    "a tree of members": {
        "type": "group",
        "up": "z",
        "metres_per_unit": 0.0254,
        "definitions": [PATCH | {"name": "sail"}, PATCH | {"name": "sail", "up": "z"}, TENT],
        "members": [
            {"name": "ship", "color": [1, 0.5, 0, 1], "matrix": SHIFTED},
            {"definition": 2, "parent": 0, "name": "tent"},
            {"parent": 1, "name": "inside", "matrix": SHIFTED},
            {"definition": 0, "parent": 2, "color": [0, 0, 1, 0.5]},
            {"definition": 1, "parent": 2, "name": "jib"},
            {"surface": {"type": "bspline", "control_net": WAVES}, "parent": 2},
        ],
    },
}
"""Further surfaces, by a title: with many defaults, or with numbers of many digits.

`ARC` has 4 points of a curve, and `WAVES` 4 × 5 control points.
"""

ALL_SURFACES = {**SURFACES, **UNUSUAL_SURFACES}


def parse_surface(document: Any) -> Surface:
    """The surface of this definition."""
    return validate_document(SurfaceRequest, {"surface": document}, LIMITS).to_surface()


def compute_id(document: Any) -> str:
    """The id of the surface of this definition."""
    return surface_id(canonical_content(parse_surface(document)))


def parse_text(text: str) -> Surface:
    """The surface of this JSON text of a definition."""
    body = f'{{"surface":{text}}}'.encode()
    return parse_request(SurfaceRequest, body, LIMITS).to_surface()


@pytest.mark.slow
def test_all_spellings_of_a_surface_have_one_id() -> None:
    random, ids, texts = Random(1), set[str](), set[str]()
    for content in ALL_SURFACES.values():
        # Ribbons and groups take ten times as long as the others.
        count = 15 if content.get("type") in ("ribbon", "group") else 40
        spellings = [spell_surface(content, random) for _ in range(count)]
        assert {surface_id(canonical_content(parse_text(text))) for text in spellings} == {
            compute_id(content)
        }
        ids.add(compute_id(content))
        texts.update(spellings)
    assert len(texts) >= 600
    assert len(ids) == len(ALL_SURFACES)


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_all_spellings_of_a_number_have_its_value(number: float) -> None:
    for numeral in spell_number(number):
        parsed = parse_document(numeral.encode())
        assert isinstance(parsed, int | float)
        assert float(parsed) == number


@pytest.mark.parametrize("name", [*ALL_SURFACES, *EXAMPLES])
def test_a_surface_is_restored_from_its_content(name: str) -> None:
    surface = parse_surface(ALL_SURFACES[name]) if name in ALL_SURFACES else find(name).surface()
    content = canonical_content(surface)
    restored_surface = restore_surface(content, LIMITS)
    assert canonical_content(restored_surface) == content
    assert content_key(restored_surface) == content_key(surface)
    text = orjson.dumps(definition(restored_surface), option=orjson.OPT_SERIALIZE_NUMPY)
    assert canonical_content(parse_surface(orjson.loads(text))) == content


def test_every_field_of_every_kind_is_part_of_the_content() -> None:
    """For each field of each class, some surface above has another value than the default."""
    names_of: dict[type, set[str]] = {}
    documents = [
        *ALL_SURFACES.values(),
        *(each | {"name": "a", "up": "z"} for each in ALL_SURFACES.values()),
    ]
    for value in (part for document in documents for part in _list_values(parse_surface(document))):
        for each in fields(value):
            default = each.default
            if each.default_factory is not MISSING:
                default = each.default_factory()
            if each.init and content_key(getattr(value, each.name)) != content_key(default):
                names_of.setdefault(type(value), set()).add(each.name)
    # The number of a definition in the request is only for errors.
    names_of[Member].add("definition")
    for kind, names in names_of.items():
        # The name and the up axis of the curve of a tube or ribbon have no effect.
        ignored_fields = {"name", "up"} if kind in (BezierCurve, BsplineCurve) else set()
        assert names | ignored_fields == {each.name for each in fields(kind) if each.init}, kind


def _list_values(value: Any) -> Iterator[Any]:
    """The surface, and all members, surfaces, curves and channels in it."""
    yield value
    if isinstance(value, GroupSurface):
        for member in value.members:
            yield member
            if member.surface is not None:
                yield from _list_values(member.surface)
    for name in ("curve", "channels"):
        if hasattr(value, name):
            yield getattr(value, name)


def _list_number_paths(value: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """The paths of all numbers in a definition that need not be integers.

    Only a definition has a `type`; attributes may have the same names as fields of integers.
    """
    if isinstance(value, dict | list):
        items = value.items() if isinstance(value, dict) else enumerate(value)
        for key, item in items:
            if (
                key not in ("patches", "triangles", "parts", "degree", "sides")
                or "type" not in value
            ):
                yield from _list_number_paths(item, (*path, key))
    elif type(value) in (int, float):
        yield path


def _change_number(value: Any, path: tuple[Any, ...], towards: float) -> Any:
    """A copy in which the number at `path` is replaced by the next float64 towards `towards`."""
    if not path:
        return math.nextafter(value, towards)
    copy = dict(value) if isinstance(value, dict) else list(value)
    copy[path[0]] = _change_number(value[path[0]], path[1:], towards)
    return copy


@given(st.sampled_from([*ALL_SURFACES]), st.sampled_from([math.inf, -math.inf]), st.data())
def test_a_change_of_the_last_bit_changes_the_id(
    name: str, towards: float, data: st.DataObject
) -> None:
    document = ALL_SURFACES[name]
    path = data.draw(st.sampled_from([*_list_number_paths(document)]))
    try:
        changed_id = compute_id(_change_number(document, path, towards))
    except InvalidRequest:
        assume(False)  # such as a colour above 1, or a knot too close to the next
    assert changed_id != compute_id(document)


@pytest.mark.parametrize(
    ("first", "second"),
    [
        (PATCH | {"name": "\u00e9"}, PATCH | {"name": "e\u0301"}),
        (PATCH, PATCH | {"weights": [[1, 1, 1], [1, 1, 1]]}),
        (PATCH | {"uvs": [[[0, 1]]]}, PATCH | {"attributes": {"uvs": [[[0, 1]]]}}),
        (PATCH | {"attributes": {"a": [[[0]]]}}, PATCH | {"attributes": {"b": [[[0]]]}}),
        (TENT | {"parts": {"a": [0, 1]}}, TENT | {"parts": {"a": [1, 0]}}),
        (TENT | {"patches": [[[0, 1], [2, 3]]]}, TENT | {"patches": [[[0, 2], [1, 3]]]}),
        ({"type": "bspline", "control_net": WAVES, "knots": "uniform"},
         {"type": "bspline", "control_net": WAVES, "knots": [[*range(8)], [*range(9)]]}),
        ({"control_net": [[[1, 2, 3]] * 2] * 3}, {"control_net": [[[1, 2, 3]] * 3] * 2}),
    ],
)  # fmt: skip
def test_different_surfaces_have_different_ids(first: Json, second: Json) -> None:
    assert compute_id(first) != compute_id(second)


def test_arrays_and_lists_of_equal_numbers_have_one_id() -> None:
    net = np.array([[[0.5, 1, -0.0], [1, 2, 3]], [[1e9, 0, 2], [-4, 5, 0.25]]])
    expected = compute_id({"control_net": net.tolist()})
    arrays = (net, net.astype(">f8"), net.astype("<f4"), np.asfortranarray(net))
    assert {compute_id({"control_net": array}) for array in arrays} == {expected}


def test_very_large_and_small_weights_count_by_their_ratios() -> None:
    """The service scales such weights by a power of two, which is exact."""
    weights: FloatArray = np.array([[1.0, 3.0, 2.0], [1.0, 1.0, 7.0]])
    ids = {compute_id(PATCH | {"weights": weights * 2.0**k}) for k in (100, 101, -700)}
    assert len(ids) == 1
    assert ids != {compute_id(PATCH | {"weights": weights})}


def test_the_content_has_the_documented_bytes() -> None:
    """The test computes the bytes by code of its own."""
    net = [[[0, 0, 0], [0, 1.5, 0]], [[1, 0, -0.0], [1, 1, 1]]]
    numbers = np.array(net).astype("<f8") + 0.0  # −0 becomes 0
    header = (
        b'{"arrays":[["float64",[2,2,3]]],"canonical":1,'
        b'"surface":{"control_net":null,"name":"\\u00e9","type":"bezier","up":"y"}}'
    )
    content = header + b"\n" + numbers.tobytes()
    surface = parse_surface({"control_net": net, "name": "é"})
    assert canonical_content(surface) == content
    assert surface_id(content) == sha256(content).hexdigest()


def test_ids_are_equal_to_the_golden_ids() -> None:
    """Ids must never change, because surfaces are stored under them."""
    assert compute_ids() == json.loads(IDS.read_text())


def compute_ids() -> dict[str, str]:
    """The ids of the built-in examples and of the surfaces above, by name."""
    example_ids = {
        name: surface_id(canonical_content(example.surface())) for name, example in EXAMPLES.items()
    }
    return example_ids | {name: compute_id(document) for name, document in ALL_SURFACES.items()}


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"\n",
        b"{}\n",
        b"[]\n",
        b"null\n",
        b'{"arrays":[],"canonical":2,"surface":{}}\n',
        b'{"arrays":[],"canonical":1}\n',
        b'{"arrays":{},"canonical":1,"surface":null}\n',
        b'{"arrays":[["float64",[-1]]],"canonical":1,"surface":{"control_net":null}}\n' + bytes(24),
        b'{"arrays":[["float64",[1e9]]],"canonical":1,"surface":{"control_net":null}}\n',
        b'{"arrays":[["float64",["1"]]],"canonical":1,"surface":{"control_net":null}}\n' + bytes(8),
        b'{"arrays":[["float64",3]],"canonical":1,"surface":{"control_net":null}}\n' + bytes(24),
        b'{"arrays":[["float32",[3]]],"canonical":1,"surface":{"control_net":null}}\n' + bytes(12),
        b'{"arrays":[[["float64"],[3]]],"canonical":1,"surface":{"x":null}}\n' + bytes(24),
        b'{"arrays":[["float64",[' + b"9," * 99 + b'9]]],"canonical":1,"surface":{"x":null}}\n',
        b'{"arrays":[["float64",[999999999999]]],"canonical":1,"surface":{"x":null}}\n' + bytes(24),
        b'{"arrays":[["float64",[1]]],"canonical":1,"surface":{}}\n' + bytes(8),
        b'{"arrays":[],"canonical":1,"surface":{"x":null}}\n',
        b'{"arrays":[],"canonical":1,"surface":' + b"[" * 100_000 + b"]" * 100_000 + b"}\n",
        b'{"arrays":[],"canonical":1,"surface":{"sides":' + b"9" * 10_000 + b"}}\n",
    ],
    ids=len,  # the contents themselves would be too long
)
def test_invalid_contents_are_refused(content: bytes) -> None:
    with pytest.raises(DamagedObject):
        restore_surface(content, LIMITS)


def test_truncated_and_longer_contents_are_refused() -> None:
    content = canonical_content(find("saddle").surface())
    for end in range(len(content)):
        with pytest.raises(DamagedObject):
            restore_surface(content[:end], LIMITS)
    with pytest.raises(DamagedObject):
        restore_surface(content + b"\0", LIMITS)


@given(st.sampled_from([*ALL_SURFACES]), st.data())
def test_damaged_contents_are_refused_or_restored_to_a_valid_surface(
    name: str, data: st.DataObject
) -> None:
    """Damage may give the content of another surface; only the hash shows the store this."""
    content = bytearray(canonical_content(parse_surface(ALL_SURFACES[name])))
    end = content.index(b"\n")
    for _ in range(data.draw(st.integers(1, 3))):
        content[data.draw(st.integers(0, end))] = data.draw(
            st.sampled_from(b'0123456789",:[]{}n-.')
        )
    try:
        surface = restore_surface(bytes(content), LIMITS)
    except (DamagedObject, InvalidRequest):
        return
    assert surface_id(canonical_content(surface))


def test_a_large_content_has_the_bytes_of_its_arrays() -> None:
    """The content adds at most 200 bytes, and the restored arrays are equal."""
    net = np.random.default_rng(1).random((65, 65, 3))
    content = canonical_content(BezierSurface(net))
    assert len(content) < net.nbytes + 200
    restored = restore_surface(content, LIMITS)
    assert isinstance(restored, BezierSurface)
    np.testing.assert_array_equal(restored.control_net, net)


if __name__ == "__main__":
    IDS.write_text(json.dumps(compute_ids(), indent=2, ensure_ascii=False) + "\n", encoding="utf-8")
