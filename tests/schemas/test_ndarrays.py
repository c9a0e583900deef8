"""NumPy arrays in place of lists are accepted, and refused, exactly like the lists."""

from dataclasses import replace
from typing import Any

import numpy as np
import orjson
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from numpy.typing import NDArray
from pydantic import ValidationError

from service.errors import InvalidRequest
from service.schemas import bezier, bspline, groups, patches
from service.schemas.arrays import Array, NumberGrid
from service.schemas.bezier import split_rows
from service.schemas.document import DocumentLimits
from service.schemas.request import MeshRequest
from service.schemas.validation import invalid_request, validate_document
from service.surface.content_key import content_key

GRIDS = (
    bezier.CONTROL_NET,
    bezier.NET_WEIGHTS,
    bspline.KNOTS,
    patches.VERTICES,
    patches.PATCHES,
    bezier.TRIANGLE_NET,
    bezier.TRIANGLE_WEIGHTS,
    patches.TRIANGLES,
    groups.MATRIX,
    NumberGrid(("patch numbers",), integers=True),
)
DTYPES = ("<f8", ">f8", "<f4", ">f4", "<i8", ">i8", "<i4", "<u8", ">u2", "i1", "?")
SMALL_LIMITS = DocumentLimits(max_control_points=12, max_degree=3)


def to_lists(values: NDArray[Any], grid: NumberGrid) -> Any:
    """The nested lists with the values of an array; triangles as rows, each shorter by one."""
    if grid.triangle_level is None or values.ndim < grid.triangle_level:
        return values.tolist()
    if grid.triangle_level == 2:
        inner = replace(grid, triangle_level=1)
        return [to_lists(each, inner) for each in values]
    return [row.tolist() for row in split_rows(values)]


def parse_value(grid: NumberGrid, value: Any) -> Array | tuple[str, str, str]:
    """The array, or code, pointer and message of the first issue."""
    try:
        return grid.array(value, SMALL_LIMITS)
    except ValidationError as error:
        issue = invalid_request(error).issues[0]
        return issue.code, issue.pointer, issue.message


@given(
    grid=st.sampled_from(GRIDS),
    extra_axes=st.sampled_from([0, 0, 0, 0, -1, 1]),
    dtype=st.sampled_from(DTYPES),
    step=st.sampled_from([1, 1, 2, -1]),
    data=st.data(),
)
def test_arrays_are_parsed_like_their_lists(
    grid: NumberGrid, extra_axes: int, dtype: str, step: int, data: Any
) -> None:
    axes = max(len(grid.levels) - (grid.triangle_level is not None) + extra_axes, 1)
    shape = [data.draw(st.sampled_from([3, 3, 3, 2, 4, 6, 1, 0])) for _ in range(axes)]
    if grid.triangle_level is not None and len(shape) >= grid.triangle_level:
        # The axis of all rows of a triangle: 1, 3, 6, 10 or 15 entries.
        shape[grid.triangle_level - 1] = data.draw(st.sampled_from([3, 3, 6, 10, 1, 15]))
    numbers = np.arange(np.prod(shape)).reshape(shape)
    values = (numbers.astype("<f8") / 4 if dtype[1:2] == "f" else numbers).astype(dtype)
    # With a step of 2 the array is not contiguous, and with −1 it is in reverse order.
    values = np.repeat(values, abs(step), axis=-1)[..., ::step]
    expected = parse_value(grid, to_lists(values, grid))
    actual = parse_value(grid, values)
    if isinstance(expected, np.ndarray):
        assert isinstance(actual, np.ndarray)
        assert actual.dtype == expected.dtype
        assert actual.dtype.isnative
        assert actual.tolist() == expected.tolist()
    else:
        assert actual == expected


@given(st.sampled_from([10, 15]), st.integers(0, 14), st.sampled_from([np.nan, np.inf, -np.inf]))
@example(10, 9, np.nan)
def test_numbers_that_are_not_finite_are_refused(count: int, index: int, value: float) -> None:
    weights = np.ones(count)
    weights[index % count] = value
    pointers = [f"/{m}/{j}" for m, row in enumerate(split_rows(weights)) for j in range(len(row))]
    # Without a limit of the degree, which 15 weights exceed.
    issue = parse_value(replace(bezier.TRIANGLE_WEIGHTS, degree_levels=()), weights)
    assert issue == ("not_finite", pointers[index % count], "Every number must be finite.")


def test_each_number_that_is_not_finite_has_an_issue_up_to_20_issues() -> None:
    net = np.zeros((3, 4, 3))
    net[1, 2, 0] = net[2, 0, 1] = np.nan
    with pytest.raises(InvalidRequest) as refusal:
        validate_document(MeshRequest, {"surface": {"control_net": net}})
    assert [issue.pointer for issue in refusal.value.issues] == [
        "/surface/control_net/1/2/0",
        "/surface/control_net/2/0/1",
    ]
    with pytest.raises(ValidationError) as refusal_of_25_points:
        bezier.CONTROL_NET.array(np.full((5, 5, 3), np.inf))
    assert refusal_of_25_points.value.error_count() == 20


@pytest.mark.parametrize("index", [2**53 + 1, -(2**53) - 1, np.iinfo(np.int64).min])
def test_indices_beyond_the_integers_of_float64_are_refused(index: int) -> None:
    issue = parse_value(patches.PATCHES, np.array([[[0, 1], [2, index]]]))
    assert issue == ("index_out_of_range", "/0/1/1", "No list is that long.")


@pytest.mark.parametrize("count", [2, 4, 5, 7])
def test_an_array_that_is_not_the_size_of_a_triangle_is_refused(count: int) -> None:
    issue = parse_value(bezier.TRIANGLE_NET, np.zeros((count, 3)))
    assert issue[:2] == ("ragged", "")


@pytest.mark.parametrize(
    "values",
    [
        pytest.param(
            np.zeros((2, 2, 3), dtype=np.longdouble),
            marks=pytest.mark.skipif(
                np.dtype("g").itemsize == 8, reason="longdouble is float64 on this platform"
            ),
        ),
        np.zeros((2, 2, 3), dtype=complex),
        np.zeros((2, 2, 3), dtype=object),
        np.full((2, 2, 3), "1"),
        np.zeros((2, 2, 3), dtype="datetime64[s]"),
        np.zeros((2, 2, 3), dtype=[("x", "f8")]),
    ],
    ids=lambda values: str(values.dtype.kind),
)
def test_values_that_are_not_numbers_are_refused(values: NDArray[Any]) -> None:
    issue = parse_value(bezier.CONTROL_NET, values)
    assert issue == ("wrong_type", "/0/0/0", "This must be a number.")


@pytest.mark.parametrize(
    ("fields", "code", "pointer"),
    [
        ({"name": np.zeros(3)}, "wrong_type", "/surface/name"),
        ({"attributes": np.zeros(3)}, "wrong_type", "/surface/attributes"),
        ({"type": np.zeros(3)}, "wrong_type", "/surface/type"),
        ({"up": np.array(0)}, "wrong_value", "/surface/up"),
        ({"more": np.zeros(3)}, "unknown_field", "/surface/more"),
        ({"type": "bspline", "degree": np.array([1, 1])}, "wrong_type", "/surface/degree"),
    ],
    ids=lambda value: str(value)[:20],
)
def test_an_array_for_a_field_that_is_no_list_of_numbers_is_refused(
    fields: dict[str, Any], code: str, pointer: str
) -> None:
    with pytest.raises(InvalidRequest) as refusal:
        validate_document(MeshRequest, {"surface": {"control_net": np.zeros((2, 2, 3))} | fields})
    issue = refusal.value.issues[0]
    assert (issue.code, issue.pointer, issue.got) == (code, pointer, "a list")


def test_every_kind_of_surface_accepts_arrays() -> None:
    points = np.array([[0, 0, 0], [1, 2, 0], [3, 2, 1], [4, 0, 1]], dtype=">f4")
    knots = np.array([0, 0, 1, 1], dtype=np.int32)
    documents: list[dict[str, Any]] = [
        {"type": "tube", "curve": {"control_points": points}, "radius": np.array([0.5, 0.25])},
        {"type": "ribbon", "curve": {"control_points": points, "weights": np.ones(4)},
         "width": np.array([1]), "camera": np.array([0, 0, 9])},
        {"type": "bspline", "control_net": points.reshape(2, 2, 3), "degree": 1,
         "knots": ["clamped", knots], "uvs": np.zeros((1, 1, 2))},
        {"type": "patches", "vertices": points, "patches": np.array([[[0, 1], [2, 3]]], dtype="u1"),
         "triangles": np.array([[0, 1, 2]]), "parts": {"a": np.array([1])},
         "attributes": {"t": np.zeros((4, 1), dtype=np.float32)}},
    ]  # fmt: skip
    members = [{"surface": each, "matrix": np.eye(4)} for each in documents]
    documents.append({"type": "group", "members": members})
    for document in documents:
        surface = validate_document(MeshRequest, {"surface": document}).to_surface()
        text = orjson.dumps(document, default=lambda array: array.tolist())
        # A list of a triangle's indices has rows, and an array has not.
        text = text.replace(b'"triangles":[[0,1,2]]', b'"triangles":[[[0,1],[2]]]')
        assert content_key(surface) == content_key(
            validate_document(MeshRequest, {"surface": orjson.loads(text)}).to_surface()
        )
