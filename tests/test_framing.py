"""A tree with arrays comes back from its frame, and other bytes are refused."""

from typing import Any

import numpy as np
import pytest

from service.framing import UNREADABLE, mark_nulls, read_frame, write_frame

NET = np.arange(12.0).reshape(2, 2, 3)
TREE: dict[str, Any] = {
    "faces": [{"net": NET, "pcurve": None}, {"net": NET[::-1, :, ::2], "pcurve": NET[0]}],
    "name": "Größe \u2028",
    "ends": (np.array([3, -1]), np.empty((0, 3))),
    "up": 1.5,
}


def _frame() -> bytes:
    return write_frame("tree", mark_nulls(TREE | {"ends": list(TREE["ends"])}), version=2)


def test_a_tree_with_arrays_and_nulls_comes_back() -> None:
    header = read_frame("tree", _frame())
    assert header["version"] == 2
    tree = header["tree"]
    assert tree["name"] == TREE["name"]
    assert tree["up"] == 1.5
    assert tree["faces"][0]["pcurve"] is None
    for got, expected in (
        (tree["faces"][0]["net"], NET),
        (tree["faces"][1]["net"], NET[::-1, :, ::2]),
        (tree["faces"][1]["pcurve"], NET[0]),
        (tree["ends"][0], TREE["ends"][0]),
        (tree["ends"][1], TREE["ends"][1]),
    ):
        assert got.dtype == expected.dtype
        assert got.shape == expected.shape
        assert (got == expected).all()


def test_the_header_is_one_line_and_the_numbers_are_little_endian() -> None:
    frame = write_frame("tree", {"b": np.array([1.0]), "a": np.array([[2]])})
    header = b'{"arrays":[["int64",[1,1]],["float64",[1]]],"tree":{"a":null,"b":null}}\n'
    assert frame == header + (2).to_bytes(8, "little") + b"\0\0\0\0\0\0\xf0\x3f"


@pytest.mark.parametrize(
    "frame",
    [
        b"",
        b"{}\n",
        b"[]\n",
        b"no JSON\n",
        _frame()[:-1],
        _frame() + b"\0",
        b'{"arrays":[["float64",[-1]]],"tree":null}\n',
        b'{"arrays":[["float32",[1]]],"tree":null}\n\0\0\0\0',
        b'{"arrays":[["float64",[99999999999999]]],"tree":null}\n',
        b'{"arrays":[["float64",[1e3]]],"tree":null}\n',
        b'{"arrays":[["float64",[1]]],"tree":[null,null]}\n\0\0\0\0\0\0\0\0',
        b'{"arrays":[["float64",[1]]],"tree":[]}\n\0\0\0\0\0\0\0\0',
        b'{"arrays":[],"tree":' + b"[" * 100_000 + b"]" * 100_000 + b"}\n",
    ],
)
def test_other_bytes_are_refused(frame: bytes) -> None:
    with pytest.raises(UNREADABLE):
        read_frame("tree", frame)
