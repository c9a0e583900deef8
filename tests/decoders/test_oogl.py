"""OOGL patches: files of this service and of Geomview are read; errors name the line."""

import json
import subprocess
import tracemalloc
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from service.decoders.oogl import FREE_OBJECTS, decode
from service.encoders.format import EncodeOptions
from service.encoders.registry import BY_NAME
from service.engine.options import MeshOptions
from service.errors import MalformedBody, SurfaceError
from service.pipeline.mesh import render
from service.schemas.request import MeshRequest
from service.schemas.validation import validate_document
from service.surface.examples.catalogue import find
from service.surface.kinds import Surface
from service.surface.lowered import PatchModel
from service.surface.patches import PatchSurface
from tests.clients.geomview import read_oogl
from tools.programs import find_program

MAX_POINTS = 1_000_000
"""The limit of control points, for tests in which it does not matter."""

GEOMVIEW = Path("/usr/share/geomview/geom")


def encode_patches(surface: Surface, *overlays: Any) -> bytes:
    """An OOGL file with the Bézier patches of a surface, in place of a mesh."""
    options = MeshOptions(overlays=overlays)
    return render(surface, options, BY_NAME["oogl"], EncodeOptions("bez"))


def read_surface(content: bytes) -> Surface:
    """The surface in a file, validated like the document of a request."""
    document = decode(content, None, MAX_POINTS)
    return validate_document(MeshRequest, {"surface": document}).to_surface()


def read_batch(content: bytes) -> tuple[NDArray[np.float64], NDArray[np.float64] | None]:
    """Control points (P, p+1, q+1, 3) of the patches in a file; weights (P, p+1, q+1) or None."""
    surface = read_surface(content)
    assert isinstance(surface, PatchSurface)
    weights, patches = surface.weights, surface.patches
    assert isinstance(patches, np.ndarray)
    return surface.vertices[patches], None if weights is None else weights[patches]


def lower_example(name: str) -> PatchModel:
    model = find(name).surface().lower()
    assert isinstance(model, PatchModel)
    return model


@pytest.mark.parametrize("name", ["utah-teapot", "bourke-1111", "saddle", "tveit"])
def test_encoded_patches_decode_to_equal_control_points(name: str) -> None:
    points, weights = read_batch(encode_patches(find(name).surface()))
    (expected,) = lower_example(name).batches
    assert expected.weights is None
    assert weights is None
    np.testing.assert_array_equal(points, expected.points)


@pytest.mark.parametrize("name", ["sphere", "torus", "cylinder"])
def test_rational_patches_are_decoded_up_to_rounding(name: str) -> None:
    points, weights = read_batch(encode_patches(find(name).surface(), "control_net", "boundary"))
    (expected,) = lower_example(name).batches
    np.testing.assert_array_equal(weights, expected.weights)
    np.testing.assert_allclose(points, expected.points, rtol=1e-15, atol=0)


def write_bez(nets: Any) -> bytes:
    """BEZ of degree (2, 2) from homogeneous nets (P, 3, 3, 4), in which u varies fastest."""
    rows = np.asarray(nets, float).reshape(-1, 4)
    return b"BEZ224\n" + b"\n".join(b" ".join(b"%r" % x for x in row) for row in rows.tolist())


def test_directions_make_a_torus() -> None:
    """Each side is a half circle, whose middle point is a direction; the centre is one, too."""
    x, y, w = np.array([[1, 0, -1], [0, 1, 0], [1, 0, 1]])
    nets = [
        [[[c * (3 * d + a), i * b * (3 * d + a), j * e * f, d * f]
          for c, b, f in zip(x, y, w, strict=True)]
         for a, e, d in zip(x, y, w, strict=True)]
        for i in (-1, 1) for j in (-1, 1)
    ]  # fmt: skip
    surface = read_surface(write_bez(nets))
    assert isinstance(surface, PatchSurface)
    assert surface.degree == (3, 3)
    mesh = render(surface, MeshOptions((4, 4)), BY_NAME["json"])
    points = np.array(json.loads(mesh)["vertices"])
    assert len(points) == 8 * 8  # the borders of the four patches have no gap
    from_ring = np.hypot(np.hypot(points[:, 0], points[:, 1]) - 3, points[:, 2])
    np.testing.assert_allclose(from_ring, 1, atol=1e-14)
    again = read_surface(encode_patches(surface))
    assert isinstance(again, PatchSurface)
    np.testing.assert_allclose(
        again.vertices[again.patches], surface.vertices[surface.patches], atol=1e-15
    )


def test_a_negative_weight_in_the_middle_makes_most_of_a_sphere() -> None:
    """(2 s, 2 t, 1 − s² − t², 1 + s² + t²) for s and t from −1 to 1: the centre has weight −1."""
    s, square = np.array([-1, 0, 1]), np.array([1, -1, 1])
    net = [
        [[2 * a, 2 * b, 1 - c - d, 1 + c + d] for a, c in zip(s, square, strict=True)]
        for b, d in zip(s, square, strict=True)
    ]
    points, weights = read_batch(write_bez([net]))
    assert weights is not None
    assert weights.min() > 0
    surface = read_surface(write_bez([net]))
    mesh = json.loads(render(surface, MeshOptions((6, 6)), BY_NAME["json"]))
    np.testing.assert_allclose(np.linalg.norm(mesh["vertices"], axis=1), 1, atol=1e-14)
    assert np.max(mesh["vertices"], axis=0)[2] == pytest.approx(1)
    assert points.shape[1:3] == (4, 4)


def test_corners_carry_colours_and_texture_coordinates() -> None:
    text = (
        b"STCBEZ213\n 0 0 0 1 0 0 2 0 0  0 1 0 1 1 0 2 1 0\n 0 0 1 0 0 1 1 1\n"
        b"1 0 0 1  0 1 0 1  0 0 1 1  1 1 1 1\n"
    )
    document = decode(text, None, MAX_POINTS)
    uvs, colors = (document[name][document["patches"]][0] for name in ("uvs", "colors"))
    np.testing.assert_array_equal(uvs[:, 0], [[0, 0], [0.5, 0], [1, 0]])
    np.testing.assert_array_equal(uvs[:, 1], [[0, 1], [0.5, 1], [1, 1]])
    np.testing.assert_array_equal(colors[[0, 2, 0, 2], [0, 0, 1, 1], :3],
                                  [[1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 1]])  # fmt: skip
    np.testing.assert_array_equal(colors[1, 0], [0.5, 0.5, 0, 1])
    same_document = decode(text.replace(b"STCBEZ213", b"CBEZ213_ST"), None, MAX_POINTS)
    for name in ("uvs", "colors"):
        np.testing.assert_array_equal(same_document[name], document[name])
    read_surface(text)  # the document is valid


def test_colours_of_an_encoded_file_are_decoded_exactly() -> None:
    content = encode_patches(find("bourke-1111-colors").surface())
    assert b"CBEZ" in content
    document = decode(content, None, MAX_POINTS)
    again = encode_patches(validate_document(MeshRequest, {"surface": document}).to_surface())
    assert again == content


def test_patches_of_several_degrees_become_a_group_of_all_patches() -> None:
    text = b"LIST { BEZ113 0 0 0 1 0 0 0 1 0 1 1 0 } { LIST { = BEZ 2 1 3\n" + (
        b"0 0 1 1 0 1 2 0 1 0 1 1 1 1 1 2 1 1 } } { BEZ114 0 0 0 2 2 0 0 2 0 2 0 2 2 2 0 2 }"
    )
    document = decode(text, None, MAX_POINTS)
    assert document["type"] == "group"
    first, second = (member["surface"] for member in document["members"])
    assert first["patches"].shape == (2, 2, 2)
    assert second["patches"].shape == (1, 3, 2)
    # One of the two patches of degree 1 has weights, so the other patch gets weights 1.
    assert first["homogeneous"] is True
    np.testing.assert_array_equal(first["vertices"][:, 3], [1] * 4 + [2] * 4)
    np.testing.assert_array_equal(
        first["vertices"][4:, :3] / first["vertices"][4:, 3:], first["vertices"][:4, :3]
    )
    assert "weights" not in second
    surface = validate_document(MeshRequest, {"surface": document}).to_surface()
    # An STL file has 84 bytes and 50 for each triangle: here 2 triangles for each of the 3 patches.
    assert len(render(surface, MeshOptions((1, 1)), BY_NAME["stl"])) == 84 + 50 * 6


FLAT = b"0 0 0  1 0 0  0 1 0  1 1 0"
SPELLINGS = [
    b"BEZ113 " + FLAT,
    b"BEZ 1 1 3\r\n" + FLAT + b"\r\n",
    b"{BEZ113\n" + FLAT + b"}",
    b"# a comment { BEZ\n{ = BEZ113 # another\n" + FLAT.replace(b"  ", b" #}\n") + b"\n}\n",
    b"{ = { = BEZ113 " + FLAT + b" } }",
    b"LIST\n{ BEZ113 " + FLAT + b" }\n",
    b"{LIST{LIST{BEZ113 " + FLAT + b"}}}",
    b"LIST BEZ113 " + FLAT,
    b"{ define it BEZ113 " + FLAT + b"}",
    b"appearance { +edge material { diffuse 1 0 0 } }\nBEZ113 " + FLAT,
    b"{ appearance { patchdice 2 2 } BEZ113 " + FLAT + b"}",
    b"LIST { BEZ113 " + FLAT + b" } { = SKEL 2 1\n0 0 0\n1 1 1\n2 0 1 1 0 0 1\n}",
    b"BEZ113\n+0 .0 0. 1e0 0E-3 0  0 10e-1 0  1.0 1.000 -0\f\t",
    b"BEZ113_ST " + FLAT + b" 0 0 1 0 0 1 1 1",
    b"STBEZ113 " + FLAT + b" 0 0 1 0 0 1 1 1",
    b"CBEZ113 " + FLAT + b" 1 1 1 1" * 4,
]
"""Files with the same patch, each written in another way that the format allows."""

ONLY_THIS_DECODER = (b"\r", b"+0", b"LIST BEZ", b"appearance { +edge m", b"define")
"""Parts of SPELLINGS that this decoder reads, but Geomview refuses or draws differently."""


@pytest.mark.parametrize("text", SPELLINGS)
def test_every_spelling_is_read(text: bytes) -> None:
    points, weights = read_batch(text)
    assert weights is None
    np.testing.assert_array_equal(points, [[[[0, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 0]]]])


@pytest.mark.parametrize(
    "text", [text for text in SPELLINGS if not any(part in text for part in ONLY_THIS_DECODER)]
)
def test_geomview_reads_these_spellings_too(text: bytes, tmp_path: Path) -> None:
    mesh = read_oogl(text, tmp_path)
    assert len(mesh.vertices) >= 4
    assert (mesh.vertices.min(), mesh.vertices.max()) == (0, 1)


@pytest.mark.parametrize("name", ["teapot.bez", "octant.bez", "pieces/linkA.bez", "torus.bez"])
def test_points_of_geomviews_example_files_agree_with_geomview(name: str) -> None:
    file = GEOMVIEW / name
    if not file.exists():
        pytest.skip("Geomview's examples are not installed")
    samples = 5
    process = subprocess.run(
        [find_program("bez2mesh"), str(samples), str(file)],
        capture_output=True,
        timeout=60,
        check=True,
    )
    # bez2mesh writes samples × samples lines for each patch: x y z, and sometimes a normal.
    lines = [line.split() for line in process.stdout.decode().splitlines()]
    number_lines = [line for line in lines if len(line) in (3, 6) and line[0][-1].isdigit()]
    expected = np.array([line[:3] for line in number_lines], dtype=float)
    model = read_surface(file.read_bytes()).lower()
    assert isinstance(model, PatchModel)
    (patches,) = model.batches
    options = MeshOptions((samples - 1, samples - 1), weld=False)
    obj = render(read_surface(file.read_bytes()), options, BY_NAME["obj"])
    points = np.array(
        [line.split()[1:4] for line in obj.decode().splitlines() if line.startswith("v ")],
        dtype=float,
    )
    assert len(expected) == len(points) == patches.count * samples * samples
    # Geomview may number the points in another order, so each coordinate is sorted; it has float32.
    np.testing.assert_allclose(np.sort(points, axis=0), np.sort(expected, axis=0), atol=2e-5)


REFUSALS: dict[str, tuple[bytes, str, int]] = {
    "nothing": (b"", "malformed_body", 1),
    "a comment": (b"# BEZ\n#", "malformed_body", 2),
    "another object": (b"\nOFF 3 1 0\n", "malformed_body", 2),
    "a file elsewhere": (b"LIST\n{ < other.bez }", "malformed_body", 2),
    "a name": (b"LIST\n{ :name }", "malformed_body", 2),
    "half a patch": (b"\n\nBBP\n1 2 3\n", "malformed_body", 3),
    "no patch": (b"BBP", "malformed_body", 1),
    "an empty list": (b"\nLIST", "malformed_body", 2),
    "no degrees": (b"\nBEZ\n", "malformed_body", 3),
    "a word in place of degrees": (b"BEZ\n\nzq9x7", "malformed_body", 3),
    "degree 0": (b"BEZ013 0 0 0 1 1 1", "malformed_body", 1),
    "degree 13": (b"BEZ 13 1 3 0", "malformed_body", 1),
    "dimension 2": (b"BEZ112 0 0 1 0 0 1 1 1", "malformed_body", 1),
    "prefixes in another order": (b"CSTBEZ113", "malformed_body", 1),
    "another case": (b"bez113 " + FLAT, "malformed_body", 1),
    "an open brace": (b"{ BEZ113\n" + FLAT, "malformed_body", 2),
    "a brace too many": (b"{ BEZ113\n" + FLAT + b"}\n}", "malformed_body", 3),
    "a second object": (b"{BEZ113 " + FLAT + b"}\n{BEZ113 " + FLAT + b"}", "malformed_body", 2),
    "braces within braces": (b"{\n" * 40, "malformed_body", 17),
    "many signs": (b"=" * 5000, "malformed_body", 1),
    "an appearance without an end": (b"appearance {\n" + b"{}" * 5000, "malformed_body", 1),
    "the binary form": (b"BEZ113\nBINARY\n\x01", "malformed_body", 2),
    "a word among the numbers": (b"BEZ113 0 0 0\n1 zq9x7 0", "malformed_body", 2),
    "a number with two points": (b"BEZ113 0 0 0\n1 0.0.0 0" + b" 0" * 6, "malformed_body", 2),
    "two numbers in one": (b"BEZ113 0 0 0\n1 0-1 0" + b" 0" * 6, "malformed_body", 2),
    "a hexadecimal number": (b"BEZ113 0 0 0\n1 0x1 0" + b" 0" * 6, "malformed_body", 2),
    "an underline": (b"BEZ113 0 0 0\n1 1_0 0" + b" 0" * 6, "malformed_body", 2),
    "a sign": (b"BEZ113 0 0 0\n1 - 0" + b" 0" * 6, "malformed_body", 2),
    "a thousand digits": (b"BEZ113 0 0 0\n1 " + b"1" * 1000 + b" 0" * 7, "malformed_body", 2),
    "a million digits": (b"BEZ113\n" + b"1" * 1_000_000, "malformed_body", 2),
    "1e400": (b"BEZ113 0 0 0\n1 0 0\n0 1e400 0\n1 1 0", "not_finite", 3),
    "-inf": (b"BEZ113 0 0 0\n1 0 -inf\n0 1 0\n1 1 0", "not_finite", 2),
    "weight 0": (b"BEZ114 0 0 0 1\n1 0 0 1\n0 1 0 0\n1 1 0 1", "weight_not_positive", 3),
    "weight -1": (b"BEZ114 0 0 0 1\n1 0 0 1\n0 1 0 1\n1 1 0\n-1", "weight_not_positive", 5),
}
"""Files, with the code and the line of the error."""


@pytest.mark.parametrize(("text", "code", "line"), REFUSALS.values(), ids=list(REFUSALS))
def test_errors_name_the_line(text: bytes, code: str, line: int) -> None:
    with pytest.raises(SurfaceError) as error:
        decode(text, None, MAX_POINTS)
    issue = error.value.issues[0]
    assert issue.code == code
    assert f"(line {line})" in issue.message
    # An error does not repeat the input.
    assert "zq9x7" not in str(issue)


def test_an_error_at_the_end_of_the_text_says_so() -> None:
    for text in (b"BEZ", b"BEZ\n", b"LIST { BEZ114 " + b"1 " * 16):
        with pytest.raises(SurfaceError) as error:
            decode(text, None, MAX_POINTS)
        assert error.value.issues[0].got == "the end of the text"


@pytest.mark.parametrize("content", ["BEZ113 é".encode(), b"BEZ113\0", "BEZ113".encode("utf-16")])
def test_characters_that_are_not_ascii_are_refused(content: bytes) -> None:
    with pytest.raises(MalformedBody):
        decode(content, None, MAX_POINTS)


def test_the_limit_of_control_points_is_for_the_whole_file() -> None:
    text = b"LIST" + b"{BEZ113 " + FLAT + b"}" + b"{BEZ113 " + FLAT + b" " + FLAT + b"}"
    assert decode(text, None, 12)
    for limit in (11, 4, 3):
        with pytest.raises(SurfaceError) as error:
            decode(text, None, limit)
        assert error.value.issues[0].code == "too_many_control_points"


@pytest.mark.parametrize("empty_object", [b"{VECT 1}", b"{LIST}", b"{appearance {} VECT 1}"])
def test_too_many_objects_without_patches_are_refused(empty_object: bytes) -> None:
    """Beside those of the patches `FREE_OBJECTS` are allowed; an object in braces counts as two.

    `LIST` is one of them, so one object in braces less than `FREE_OBJECTS` / 2 is allowed.
    """
    patches = (b"{BEZ113 " + FLAT + b"}") * 3
    few_objects = b"{VECT 1}" * (FREE_OBJECTS // 2 - 1)
    assert decode(b"LIST" + patches + few_objects, None, 12)
    with pytest.raises(SurfaceError) as error:
        decode(b"LIST" + patches + empty_object * (FREE_OBJECTS // 2), None, 12)
    assert error.value.issues[0].code == "too_many_control_points"


def test_long_texts_are_refused_before_much_memory_is_used() -> None:
    """8 MiB of too many numbers or comments, or of other errors, take less than 6 MiB of memory."""
    for unit in (b"1 ", b"#\n", b"1e1 ", b"{BEZ113 " + FLAT + b"}", b"\n"):
        text = b"LIST {BBP " + unit * ((8 << 20) // len(unit))
        tracemalloc.start()
        with pytest.raises(SurfaceError):
            decode(text, None, 1000)
        _, peak = tracemalloc.get_traced_memory()
        tracemalloc.stop()
        assert peak < 6 << 20


WORDS = st.sampled_from(
    [b"{", b"}", b"=", b"LIST", b"BEZ113", b"BBP", b"BEZ", b"appearance", b"SKEL", b"#", b"\n",
     b"1", b"-2.5e1", b"nan", b"x", FLAT, b"BEZ113 " + FLAT, b"CBEZ114_ST", b"1e999", b"define"]
)  # fmt: skip


@given(st.lists(WORDS, max_size=12).map(b" ".join))
def test_any_text_is_decoded_or_refused(text: bytes) -> None:
    with suppress(SurfaceError):
        assert decode(text, None, MAX_POINTS)["type"] in ("patches", "group")
