"""The query of the URL of a mesh: all spellings of the same options have one canonical text."""

from math import pi
from types import NoneType
from typing import Any, Literal, get_args, get_origin
from urllib.parse import parse_qsl, quote

import pytest
from hypothesis import given
from hypothesis import strategies as st

from service.engine.mesh.mesh import ENGINE
from service.schemas.accuracy import ACCURACY_FIELDS
from service.schemas.options import MeshOptionFields
from service.schemas.query import canonical_query, parse_mesh_query

FIELDS = MeshOptionFields.model_fields


def positive_numbers(max_value: float) -> st.SearchStrategy[float]:
    return st.floats(0, max_value, exclude_min=True, allow_subnormal=True)


VALUES: dict[str, st.SearchStrategy[Any]] = {
    "resolution": st.lists(st.integers(1, 65536), min_size=2, max_size=2) | st.just([8, 8]),
    "tolerance": positive_numbers(1e6),
    "relative_tolerance": positive_numbers(1),
    "angle_tolerance": positive_numbers(pi),
    "max_triangles": st.integers(1, 2**53 - 1) | st.just(10**15),
    "max_bytes": st.integers(1, 2**53 - 1) | st.just(2**53 - 1),
    "crease_angle": st.floats(0, pi) | st.just(-0.0),
    "weld_tolerance": st.floats(0, 1e-6) | st.just(1e-12),
    "overlays": st.permutations(["control_net", "boundary"]).flatmap(
        lambda names: st.integers(0, 2).map(lambda n: tuple(names[:n]))
    ),
    "isocurves": st.lists(st.integers(0, 1024), min_size=2, max_size=2),
    "wire_width": positive_numbers(1e6),
    "wire_sides": st.integers(3, 256),
}


def option_values(name: str) -> st.SearchStrategy[Any]:
    """Values of an option."""
    if name in VALUES:
        return VALUES[name]
    field = FIELDS[name]
    kinds = [kind for kind in get_args(field.annotation) or () if kind is not NoneType]
    if field.annotation is bool:
        return st.booleans()
    if get_origin(field.annotation) is Literal:
        return st.sampled_from(get_args(field.annotation))
    return st.sampled_from(get_args(kinds[0]))


@st.composite
def chosen_options(draw: st.DrawFn) -> dict[str, Any]:
    """Values of some options, without a resolution if there is an accuracy, which excludes it."""
    names = draw(st.sets(st.sampled_from(sorted(FIELDS))))
    values = {name: draw(option_values(name)) for name in sorted(names)}
    accuracies = [name for name in ACCURACY_FIELDS if values.get(name)]
    if accuracies:
        values.pop("resolution", None)
    return values


@st.composite
def spelled_numbers(draw: st.DrawFn, value: float) -> str:
    """One of the many ways to write a number."""
    text = format(value, ".25g") if draw(st.booleans()) else repr(value)
    text = text.replace("+", "")  # in a query, a plus sign is a blank
    has_exponent = "e" in text
    if not has_exponent and draw(st.booleans()):
        text += "0" if "." in text else ".0"
    if not has_exponent and draw(st.booleans()):
        text += "E0"
    if not has_exponent and text[0] != "-" and draw(st.booleans()):
        text = "0" + text
    return text


@st.composite
def spelled_queries(draw: st.DrawFn, values: dict[str, Any]) -> str:
    """One of the many queries with these values; options with their default may be omitted."""
    pairs: dict[str, str] = {}
    has_accuracy = any(values.get(name) for name in ACCURACY_FIELDS)
    for name, field in FIELDS.items():
        default = field.get_default(call_default_factory=True)
        if name not in values and draw(st.booleans()):
            if default is None or (name == "resolution" and has_accuracy):
                continue
            values = {**values, name: default}
        if name in values:
            pairs[name] = draw(spelled_values(values[name]))
    if draw(st.booleans()):
        pairs["engine"] = str(ENGINE)
    order = draw(st.permutations(sorted(pairs)))
    # A list may have commas, or its parameter is repeated.
    return "&".join(
        f"{quote(name)}={quote(text)}"
        for name in order
        for text in (pairs[name].split(",") if draw(st.booleans()) else [pairs[name]])
    )


@st.composite
def spelled_values(draw: st.DrawFn, value: Any) -> str:
    """One of the many ways to write the value of an option in a query."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, float):
        return draw(spelled_numbers(value))
    if isinstance(value, list | tuple):
        if len(value) == 2 and value[0] == value[1] and draw(st.booleans()):
            value = value[:1]
        return ",".join(map(str, value))
    return str(value)


def parse_options(query: str) -> dict[str, Any]:
    """The options that a query has, without `engine`."""
    return parse_mesh_query(parse_qsl(query, keep_blank_values=True)).model_dump(exclude={"engine"})


@given(chosen_options())
def test_parsing_the_canonical_query_returns_the_options(values: dict[str, Any]) -> None:
    options = MeshOptionFields(**values)
    query = canonical_query(options)
    assert query == quote(query, safe="=&,.-_"), "no escapes, no plus signs"
    assert query.endswith(f"engine={ENGINE}")
    assert parse_options(query) == options.model_dump()
    assert canonical_query(parse_mesh_query(parse_qsl(query))) == query


@given(st.data())
def test_every_spelling_has_the_same_canonical_query(data: st.DataObject) -> None:
    values = data.draw(chosen_options())
    query = canonical_query(MeshOptionFields(**values))
    for _ in range(3):
        spelling = data.draw(spelled_queries(values))
        parsed = parse_mesh_query(parse_qsl(spelling, keep_blank_values=True))
        assert canonical_query(parsed) == query, spelling


@given(chosen_options(), chosen_options())
def test_different_options_have_different_queries(a: dict[str, Any], b: dict[str, Any]) -> None:
    first, second = MeshOptionFields(**a), MeshOptionFields(**b)
    is_same_query = canonical_query(first) == canonical_query(second)
    assert is_same_query == (first.model_dump() == second.model_dump())


@pytest.mark.parametrize(
    ("query", "canonical"),
    [
        ("", ""),
        ("resolution=16,16&faces=triangles&crease_angle=0.017453292519943295", ""),
        (f"engine={ENGINE}&weld=false&resolution=8,8", "resolution=8&weld=false&"),
        ("resolution=16,32", "resolution=16,32&"),
        ("isocurves=0,2", "isocurves=0,2&"),
        ("tolerance=0.00001", "tolerance=1e-5&"),
        ("tolerance=1.50", "tolerance=1.5&"),
        ("max_bytes=0001000", "max_bytes=1000&"),
        ("wire_width=2.0", "wire_width=2&"),
        ("wire_width=1e20", "wire_width=1e20&"),
        ("crease_angle=-0.0", "crease_angle=0&"),
        ("overlays=", ""),
        ("overlays=boundary,control_net", "overlays=boundary,control_net&"),
        ("overlays=boundary", "overlays=boundary&"),
    ],
)
def test_canonical_query_of_some_spellings(query: str, canonical: str) -> None:
    parsed = parse_mesh_query(parse_qsl(query, keep_blank_values=True))
    assert canonical_query(parsed) == f"{canonical}engine={ENGINE}"


def test_options_that_a_format_ignores_are_dropped() -> None:
    parsed = parse_mesh_query([("oogl", "bez"), ("uvs", "true"), ("resolution", "4")])
    assert canonical_query(parsed, {"oogl", "uvs"}) == f"resolution=4&engine={ENGINE}"
