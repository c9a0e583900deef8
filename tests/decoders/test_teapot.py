"""The text format of the teapot: any separators and line breaks; errors name the line."""

from contextlib import suppress

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from service.decoders import teapot
from service.decoders.format import Tree
from service.errors import SurfaceError
from service.surface.examples.catalogue import find
from service.surface.patches import PatchSurface

MAX_POINTS = 1_000_000
"""The limit of control points, for tests in which it does not matter."""


def decode(content: bytes, max_points: int = MAX_POINTS) -> Tree:
    """The decoded surface, whose kind is found from the content."""
    return teapot.decode(content, None, max_points)


def build_teapot() -> PatchSurface:
    surface = find("utah-teapot").surface()
    assert isinstance(surface, PatchSurface)
    return surface


def write_text(surface: PatchSurface, comma: str = ",", has_row_lines: bool = False) -> str:
    """The text of a surface: a line for each patch, or for each row of a patch.

    `comma` is between two numbers of a line.
    """
    lines = [str(len(surface.patches))]
    for patch in np.asarray(surface.patches) + 1:
        rows = patch if has_row_lines else patch.reshape(1, -1)
        lines += [comma.join(map(str, row)) for row in rows.tolist()]
    lines.append(str(len(surface.vertices)))
    lines += [comma.join(map(repr, vertex)) for vertex in surface.vertices.tolist()]
    return "\n".join(lines) + "\n"


@pytest.mark.parametrize("comma", [",", " ", ", ", "\t", " ,\t"])
@pytest.mark.parametrize("has_row_lines", [False, True])
@pytest.mark.parametrize("end", ["\n", "\r\n", " \n\n"])
def test_the_text_of_the_teapot_is_decoded_to_equal_arrays(
    comma: str, has_row_lines: bool, end: str
) -> None:
    surface = build_teapot()
    content = write_text(surface, comma, has_row_lines).replace("\n", end).encode()
    document = decode(content)
    np.testing.assert_array_equal(document["vertices"], surface.vertices)
    np.testing.assert_array_equal(document["patches"], surface.patches)


@st.composite
def surfaces(draw: st.DrawFn) -> PatchSurface:
    """Patches of degrees 1 to 4. Coordinates are whole numbers, so vertices look like indices."""
    side, count = draw(st.integers(2, 5)), draw(st.integers(1, 4))
    vertex_count = draw(st.integers(1, 40))
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    points = rng.integers(0, 60, (vertex_count, 3)).astype(float)
    return PatchSurface(points, rng.integers(0, vertex_count, (count, side, side)))


@given(surfaces(), st.booleans())
def test_patches_of_any_degree_are_decoded_to_equal_arrays(
    surface: PatchSurface, has_row_lines: bool
) -> None:
    content = write_text(surface, has_row_lines=has_row_lines).encode()
    document = decode(content)
    np.testing.assert_array_equal(document["patches"], surface.patches)
    np.testing.assert_array_equal(document["vertices"], surface.vertices)


VALID = "2\n1,2,3,4\n3,4,5,6\n6\n0,0,0\n0,1,0\n1,0,1\n1,1,1\n2,0,0\n2,1,0\n"
"""Two patches of degree 1, with 8 control points among 6 vertices, in 10 lines."""

REFUSALS = {
    "nothing": ("", "malformed_body", 1),
    "a word": (VALID.replace("5,6\n6", "zq9x7,6\n6"), "malformed_body", 3),
    # Without the added line, the numbers could also be read as one patch of 5 × 5 vertices.
    "no number of patches": (VALID[2:] + "0,0,0\n", "malformed_body", 1),
    "no patches": (VALID.replace("2\n1", "0\n1"), "malformed_body", 1),
    "half a patch": (VALID.replace("2\n1", "1.5\n1"), "malformed_body", 1),
    "a patch less": (VALID.replace("2\n1", "3\n1"), "malformed_body", 4),
    "an index less": (VALID.replace("3,4,5,6", "3,4,5"), "malformed_body", 3),
    "an index less everywhere": (
        VALID.replace("3,4,5,6", "3,4,5").replace("1,2,3,4", "1,2,3"), "malformed_body", 4),
    "index 0": (VALID.replace("3,4,5,6", "3,4,5,0"), "index_out_of_range", 3),
    "index 7": (VALID.replace("3,4,5,6", "3,4,5,7"), "index_out_of_range", 3),
    "index -1": (VALID.replace("3,4,5,6", "-1,4,5,6"), "index_out_of_range", 3),
    "a fraction of an index": (VALID.replace("3,4,5,6", "3.5,4,5,6"), "index_out_of_range", 3),
    "no number of vertices": ("2\n1,2,3,4\n3,4,5,6\n", "malformed_body", 3),
    "a vertex less": (VALID.replace("6\n0", "7\n0"), "malformed_body", 10),
    "a vertex more": (VALID + "1,1,1\n", "malformed_body", 11),
    "a vertex more, far below": (
        VALID + "\n ,\n" * 70_000 + "1,1,1\n", "malformed_body", 140_011),
    "a coordinate less": (VALID.replace("1,0,1", "1,0"), "malformed_body", 7),
    "a coordinate more": (VALID.replace("1,0,1", "1,0,1,1"), "malformed_body", 7),
    "1e999": (VALID.replace("1,0,1", "1,1e999,1"), "not_finite", 7),
    "NaN": (VALID.replace("1,0,1", "1,0,NaN"), "not_finite", 7),
    "a huge number among indices": (
        VALID.replace("3,4,5,6\n", "3,4,5,6,1e308\n"), "malformed_body", 3),
    "bytes": (VALID.replace("1,0,1", "1,\0,1"), "malformed_body", 7),
}  # fmt: skip
"""Texts, with the code and the line of the error."""


@pytest.mark.parametrize(("text", "code", "line"), REFUSALS.values(), ids=list(REFUSALS))
def test_errors_name_the_line(text: str, code: str, line: int) -> None:
    with pytest.raises(SurfaceError) as error:
        decode(text.encode())
    issue = error.value.issues[0]
    assert issue.code == code
    assert f"(line {line})" in issue.message
    # An error does not repeat the input.
    assert "zq9x7" not in str(issue)


def test_texts_with_too_many_control_points_are_refused() -> None:
    """The limit is 7: a text has 8 control points, another has more numbers than 7 points need."""
    assert decode(VALID.encode(), max_points=8)
    for text in (VALID, "1\n" + "1 " * 100):
        with pytest.raises(SurfaceError) as error:
            decode(text.encode(), max_points=7)
        assert error.value.issues[0].code == "too_many_control_points"


def test_a_huge_number_of_patches_without_patches_is_malformed() -> None:
    with pytest.raises(SurfaceError) as error:
        decode(b"9" * 90)
    assert error.value.issues[0].code == "malformed_body"


@given(st.text("0123456789,. \n-e", max_size=60))
def test_any_text_is_decoded_or_refused(text: str) -> None:
    with suppress(SurfaceError):
        assert decode(text.encode())["patches"].ndim == 3
