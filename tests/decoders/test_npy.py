"""NumPy files: arrays that `numpy.save` writes are read bit for bit; invalid files are refused."""

import io
import tracemalloc
from collections.abc import Callable, Mapping
from contextlib import suppress
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from service.decoders.npy import MAX_HEADER, decode
from service.errors import MalformedBody, SurfaceError

MAX_POINTS = 1_000_000
"""The limit of control points, for tests in which it does not matter."""

DTYPES = ("<f4", "<f8", ">f4", ">f8")


def save_array(array: NDArray[Any], version: tuple[int, int] = (1, 0)) -> bytes:
    """The `.npy` file of an array, in one of the versions of the format."""
    file = io.BytesIO()
    np.lib.format.write_array(file, array, version=version)
    return file.getvalue()


def write_file(text: str, numbers: bytes = b"", version: bytes = b"\1\0") -> bytes:
    """A `.npy` file with this text as its header, which may be invalid."""
    size = len(text).to_bytes(2 if version == b"\1\0" else 4, "little")
    return b"\x93NUMPY" + version + size + text.encode("latin-1") + numbers


def write_header(descr: str = "'<f8'", order: str = "False", shape: str = "(2, 2, 3)") -> str:
    """The text of a header; each argument is the text of a value, which may be invalid."""
    return f"{{'descr': {descr}, 'fortran_order': {order}, 'shape': {shape}, }}\n"


NET = np.arange(12.0).reshape(2, 2, 3)
FILE = save_array(NET)
BYTES = NET.tobytes()


@st.composite
def arrays(draw: st.DrawFn) -> NDArray[Any]:
    """Control nets of every type and order, with any bits, NaN included."""
    shape = draw(st.lists(st.integers(1, 4), min_size=2, max_size=3))
    shape.append(draw(st.sampled_from((3, 4))))
    dtype = np.dtype(draw(st.sampled_from(DTYPES)))
    bits = np.random.default_rng(draw(st.integers(0, 2**32))).bytes(
        int(np.prod(shape)) * dtype.itemsize
    )
    array = np.frombuffer(bits, dtype).reshape(shape)
    return np.asfortranarray(array) if draw(st.booleans()) else array


def join_weights(document: Mapping[str, Any]) -> NDArray[Any]:
    """The array of the file: the control points (…, 3) of a surface, or with weights (…, 4)."""
    if document["type"] == "patches":
        points, weights = document["vertices"][document["patches"]], document.get("weights")
        weights = None if weights is None else weights[document["patches"]]
    else:
        points, weights = document["control_net"], document.get("weights")
    return points if weights is None else np.concatenate((points, weights[..., None]), axis=-1)


@given(arrays(), st.sampled_from(((1, 0), (2, 0), (3, 0))))
def test_saved_arrays_are_decoded_bit_for_bit(
    array: NDArray[Any], version: tuple[int, int]
) -> None:
    document = decode(save_array(array, version), None, MAX_POINTS)
    assert document["type"] == ("bezier" if array.ndim == 3 else "patches")
    result = join_weights(document)
    assert (result.dtype.itemsize, result.shape) == (array.dtype.itemsize, array.shape)
    assert result.astype(array.dtype).tobytes() == array.tobytes()


@pytest.mark.parametrize("dtype", DTYPES)
@pytest.mark.parametrize("arrange", [np.ascontiguousarray, np.asfortranarray])
def test_a_net_is_a_view_of_the_bytes_and_not_a_copy(
    dtype: str, arrange: Callable[..., Any]
) -> None:
    content = save_array(arrange(NET, dtype=dtype))
    net = decode(content, "bspline", MAX_POINTS)["control_net"]
    assert np.shares_memory(net, np.frombuffer(content, np.uint8))
    assert not net.flags.writeable
    np.testing.assert_array_equal(net, NET)


REPLACEMENTS = [
    (b"False", b"True "),
    (b"<f8", b">f8"),
    (b"(2, 2, 3)", b"(1, 4, 3)"),
    (b"(2, 2, 3)", b"(4,1,03) "),
    (b"(2, 2, 3)", b"(1,1,4,3)"),
    (b"(2, 2, 3)", b"(12,)    "),
    (b"'shape'", b'"shape"'),
    (b"}  ", b"} 1"),
    (b"\1\0v", b"\3\0v"),  # the version; the byte `v` begins the length of the header
]
"""Old and new bytes of a header; with the new bytes, the file stays valid or nearly valid."""


@st.composite
def damaged_files(draw: st.DrawFn) -> bytes:
    """A `.npy` file with some bytes changed, inserted, removed, or cut off at the end."""
    content = FILE
    for old, new in draw(st.lists(st.sampled_from(REPLACEMENTS), max_size=3)):
        content = content.replace(old, new)
    for _ in range(draw(st.integers(0, 3))):
        position = draw(st.integers(0, len(content)))
        new_bytes = draw(
            st.one_of(
                st.binary(max_size=4),
                st.sampled_from([b"9" * 18, b"(", b")", b"'", b",", b"{", b"}", b"0", b"-1", b"O"]),
            )
        )
        removed_count = draw(st.one_of(st.just(len(new_bytes)), st.integers(0, 4)))
        content = content[:position] + new_bytes + content[position + removed_count :]
    return content[: draw(st.integers(0, len(content)))] if draw(st.booleans()) else content


@given(damaged_files())
def test_damaged_files_are_refused_or_read_as_numpy_does_with_little_memory(content: bytes) -> None:
    result = None
    tracemalloc.start()
    try:
        with suppress(SurfaceError):
            result = join_weights(decode(content, None, MAX_POINTS))
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert peak < 1 << 18
    if result is not None:
        assert result.nbytes <= len(content)
        with np.errstate(all="ignore"):
            expected = np.load(io.BytesIO(content), allow_pickle=False)
        assert result.tobytes() == expected.tobytes()


def test_every_truncation_is_refused() -> None:
    for end in range(len(FILE)):
        with pytest.raises(MalformedBody):
            decode(FILE[:end], None, MAX_POINTS)


MALFORMED = {
    "nothing": b"",
    "other bytes": b"PK\x03\x04" + FILE,
    "version 4": FILE.replace(b"NUMPY\1", b"NUMPY\4"),
    "version 1.1": FILE.replace(b"NUMPY\1\0", b"NUMPY\1\1"),
    "a byte more": FILE + b"\0",
    "the longest header of version 1": b"\x93NUMPY\1\0\xff\xff" + b" " * 70_000,
    "the longest header of version 2": b"\x93NUMPY\2\0\xff\xff\xff\xff" + FILE,
    "no dictionary": write_file("1\n", BYTES),
    "two dictionaries": write_file(write_header() * 2, BYTES),
    "a list": write_file("[1, 2]\n", BYTES),
    "a key missing": write_file("{'descr': '<f8', 'shape': (2, 2, 3), }", BYTES),
    "a key too many": write_file(write_header().replace("}", "'x': True, }"), BYTES),
    "a key twice": write_file(write_header().replace("}", "'shape': (2, 2, 3), }"), BYTES),
    "no comma": write_file(write_header().replace(", 'f", " 'f"), BYTES),
    "a call": write_file(write_header(shape="print(1)"), BYTES),
    "a sum": write_file(write_header(shape="(1 + 1, 2, 3)"), BYTES),
    "a shape that is a word": write_file(write_header(shape="'a'"), BYTES),
    "an order that is a tuple": write_file(write_header(order="(1,)"), BYTES),
    "a length below zero": write_file(write_header(shape="(-2, -2, 3)"), BYTES),
    "a fraction": write_file(write_header(shape="(2.0, 2, 3)"), BYTES),
    "a shape larger than the file": write_file(
        write_header(shape="(999999999999999999, 4, 3)"), BYTES
    ),
    "a length of forty digits": write_file(write_header(shape=f"({'9' * 40}, 4, 3)"), BYTES),
    "brackets in brackets": write_file(write_header(shape="(" * 1500), BYTES),
    "2000 digits and no closing bracket": write_file(write_header(shape=f"({'1' * 2000}"), BYTES),
    "many blanks": write_file(write_header(shape="(" + " " * 2000 + "x)"), BYTES),
    "a digit that is not ASCII": write_file(
        write_header(shape="(٢, 2, 3)".encode().decode("latin-1")), BYTES
    ),
}


@pytest.mark.parametrize("content", MALFORMED.values(), ids=list(MALFORMED))
def test_files_that_are_not_npy_are_refused(content: bytes) -> None:
    with pytest.raises(MalformedBody) as error:
        decode(content, None, MAX_POINTS)
    assert [issue.code for issue in error.value.issues] == ["malformed_body"]


OTHER_TYPES: dict[str, tuple[bytes, str]] = {
    "objects": (write_file(write_header("'|O'"), b"\x80\4]"), "Python objects"),
    "structures": (write_file(write_header("[('x', '<f8')]"), BYTES), "structures"),
    "whole numbers": (save_array(NET.astype(np.int64)), "numbers of another type"),
    "complex numbers": (save_array(NET.astype(np.complex128)), "numbers of another type"),
    "half precision": (save_array(NET.astype(np.float16)), "numbers of another type"),
    "truth values": (save_array(NET > 1), "numbers of another type"),
    "texts": (save_array(NET.astype("U4")), "numbers of another type"),
    "native order": (write_file(write_header("'=f8'"), BYTES), "numbers of another type"),
}
"""Files whose type is none that the service reads, or is written in another way; and what the error
says that the service got."""


@pytest.mark.parametrize(("content", "got"), OTHER_TYPES.values(), ids=list(OTHER_TYPES))
def test_numbers_of_another_type_are_refused(content: bytes, got: str) -> None:
    with pytest.raises(SurfaceError) as error:
        decode(content, None, MAX_POINTS)
    issue = error.value.issues[0]
    assert (issue.code, issue.got) == ("wrong_type", got)


@pytest.mark.parametrize(
    "shape", [(), (3,), (4, 3), (2, 2, 2), (2, 2, 5), (1, 2, 2, 2), (1, 1, 2, 2, 3)]
)
def test_shapes_that_are_not_control_nets_are_refused(shape: tuple[int, ...]) -> None:
    with pytest.raises(SurfaceError) as error:
        decode(save_array(np.zeros(shape)), None, MAX_POINTS)
    assert error.value.issues[0].code == "wrong_dimension"


@pytest.mark.parametrize("shape", [(0, 2, 3), (2, 0, 3), (0, 4, 4, 3), (10**15, 0, 3), (2, 2, 0)])
def test_empty_arrays_are_refused(shape: tuple[int, ...]) -> None:
    content = write_file(write_header(shape=str(shape)))
    with pytest.raises(SurfaceError) as error:
        decode(content, None, MAX_POINTS)
    assert error.value.issues[0].code == "empty_list"


def test_arrays_with_too_many_control_points_are_refused() -> None:
    for array, pointer in ((NET, "/surface/control_net"), (NET[None], "/surface/vertices")):
        assert decode(save_array(array), None, 4)
        with pytest.raises(SurfaceError) as error:
            decode(save_array(array), None, 3)
        issue = error.value.issues[0]
        assert (issue.code, issue.pointer) == ("too_many_control_points", pointer)


@pytest.mark.parametrize(
    ("array", "kind"), [(NET, "patches"), (NET, "tube"), (NET[None], "bezier"), (NET[None], "")]
)
def test_kinds_that_do_not_fit_the_array_are_refused(array: NDArray[Any], kind: str) -> None:
    with pytest.raises(SurfaceError) as error:
        decode(save_array(array), kind, MAX_POINTS)
    assert error.value.issues[0].pointer == "/surface/type"


def test_headers_of_other_programs_are_read() -> None:
    """NumPy accepts keys in any order, any blanks, no comma at the end, and padding."""
    for text in (
        "{'shape':(2,2,3),'fortran_order':False,'descr':'<f8'}",
        "{ 'descr' : '<f8' , 'fortran_order' : False , 'shape' : ( 2 , 2 , 3 , ) , }",
        write_header().rstrip().ljust(MAX_HEADER - 1) + "\n",
    ):
        content = write_file(text, BYTES)
        np.testing.assert_array_equal(np.load(io.BytesIO(content)), NET)
        np.testing.assert_array_equal(decode(content, None, MAX_POINTS)["control_net"], NET)
