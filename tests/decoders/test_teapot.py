"""The teapot's text: every layout is the same surface, or the error names the line."""

from contextlib import suppress

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from service.decoders.teapot import decode
from service.errors import SurfaceError
from service.surface.examples import find
from service.surface.patches import PatchSurface

MOST = 1_000_000


def teapot() -> PatchSurface:
    surface = find("utah-teapot").surface()
    assert isinstance(surface, PatchSurface)
    return surface


def write_text(surface: PatchSurface, comma: str = ",", rows: bool = False) -> str:
    """The text of a surface, with one line for each patch, or for each row of a patch."""
    lines = [str(len(surface.patches))]
    for patch in np.asarray(surface.patches) + 1:
        nets = patch if rows else patch.reshape(1, -1)
        lines += [comma.join(map(str, row)) for row in nets.tolist()]
    lines.append(str(len(surface.vertices)))
    lines += [comma.join(map(repr, vertex)) for vertex in surface.vertices.tolist()]
    return "\n".join(lines) + "\n"


@pytest.mark.parametrize("comma", [",", " ", ", ", "\t", " ,\t"])
@pytest.mark.parametrize("rows", [False, True])
@pytest.mark.parametrize("end", ["\n", "\r\n", " \n\n"])
def test_the_teapot_comes_back(comma: str, rows: bool, end: str) -> None:
    surface = teapot()
    content = write_text(surface, comma, rows).replace("\n", end).encode()
    tree = decode(content, None, MOST)
    np.testing.assert_array_equal(tree["vertices"], surface.vertices)
    np.testing.assert_array_equal(tree["patches"], surface.patches)


@st.composite
def surfaces(draw: st.DrawFn) -> PatchSurface:
    """Patches of any degree over vertices of whole numbers, which look like indices."""
    side, count = draw(st.integers(2, 5)), draw(st.integers(1, 4))
    vertices = draw(st.integers(1, 40))
    rng = np.random.default_rng(draw(st.integers(0, 2**32)))
    points = rng.integers(0, 60, (vertices, 3)).astype(float)
    return PatchSurface(points, rng.integers(0, vertices, (count, side, side)))


@given(surfaces(), st.booleans())
def test_any_layout_is_found_again(surface: PatchSurface, rows: bool) -> None:
    tree = decode(write_text(surface, rows=rows).encode(), None, MOST)
    np.testing.assert_array_equal(tree["patches"], surface.patches)
    np.testing.assert_array_equal(tree["vertices"], surface.vertices)


GOOD = "2\n1,2,3,4\n3,4,5,6\n6\n0,0,0\n0,1,0\n1,0,1\n1,1,1\n2,0,0\n2,1,0\n"

REFUSED = {
    "nothing": ("", "malformed_body", 1),
    "a word": (GOOD.replace("5,6\n6", "zq9x7,6\n6"), "malformed_body", 3),
    "no number of patches": (GOOD[2:] + "0,0,0\n", "malformed_body", 1),
    "no patches": (GOOD.replace("2\n1", "0\n1"), "malformed_body", 1),
    "half a patch": (GOOD.replace("2\n1", "1.5\n1"), "malformed_body", 1),
    "a patch less": (GOOD.replace("2\n1", "3\n1"), "malformed_body", 4),
    "an index less": (GOOD.replace("3,4,5,6", "3,4,5"), "malformed_body", 3),
    "an index less everywhere": (
        GOOD.replace("3,4,5,6", "3,4,5").replace("1,2,3,4", "1,2,3"), "malformed_body", 4),
    "index 0": (GOOD.replace("3,4,5,6", "3,4,5,0"), "index_out_of_range", 3),
    "index 7": (GOOD.replace("3,4,5,6", "3,4,5,7"), "index_out_of_range", 3),
    "index -1": (GOOD.replace("3,4,5,6", "-1,4,5,6"), "index_out_of_range", 3),
    "a fraction of an index": (GOOD.replace("3,4,5,6", "3.5,4,5,6"), "index_out_of_range", 3),
    "no number of vertices": ("2\n1,2,3,4\n3,4,5,6\n", "malformed_body", 3),
    "a vertex less": (GOOD.replace("6\n0", "7\n0"), "malformed_body", 10),
    "a vertex more": (GOOD + "1,1,1\n", "malformed_body", 11),
    "a vertex more, far below": (
        GOOD + "\n ,\n" * 70_000 + "1,1,1\n", "malformed_body", 140_011),
    "a coordinate less": (GOOD.replace("1,0,1", "1,0"), "malformed_body", 7),
    "a coordinate more": (GOOD.replace("1,0,1", "1,0,1,1"), "malformed_body", 7),
    "1e999": (GOOD.replace("1,0,1", "1,1e999,1"), "not_finite", 7),
    "NaN": (GOOD.replace("1,0,1", "1,0,NaN"), "not_finite", 7),
    "a huge number among indices": (
        GOOD.replace("3,4,5,6\n", "3,4,5,6,1e308\n"), "malformed_body", 3),
    "bytes": (GOOD.replace("1,0,1", "1,\0,1"), "malformed_body", 7),
}  # fmt: skip


@pytest.mark.parametrize(("text", "code", "line"), REFUSED.values(), ids=list(REFUSED))
def test_errors_name_the_line(text: str, code: str, line: int) -> None:
    with pytest.raises(SurfaceError) as caught:
        decode(text.encode(), None, MOST)
    issue = caught.value.issues[0]
    assert issue.code == code
    assert f"(line {line})" in issue.message
    assert "zq9x7" not in str(issue)


def test_control_points_are_counted() -> None:
    assert decode(GOOD.encode(), None, 8)
    for text in (GOOD, "1\n" + "1 " * 100, "9" * 90):
        with pytest.raises(SurfaceError) as caught:
            decode(text.encode(), None, 7)
        assert caught.value.issues[0].code in ("too_many_control_points", "malformed_body")


@given(st.text("0123456789,. \n-e", max_size=60))
def test_any_text_is_patches_or_refused(text: str) -> None:
    with suppress(SurfaceError):
        assert decode(text.encode(), None, MOST)["patches"].ndim == 3
