"""The client reads every archive that `numpy.load` reads, and the same arrays."""

from io import BytesIO
from typing import Any
from zipfile import BadZipFile

import numpy as np
import pytest

from service.client import npz
from tests.encoders.test_golden import FOLDER

ARRAYS = {
    "none": np.zeros((0, 3)),
    "column": np.arange(7, dtype=np.uint32),
    "letters": np.frombuffer(b"{}", np.uint8),
    "attributes/heat": np.arange(6.0).reshape(2, 3),
}


def load(content: bytes) -> dict[str, Any]:
    with np.load(BytesIO(content), allow_pickle=False) as file:
        return dict(file)


def write(*, compress: bool, **arrays: Any) -> bytes:
    file = BytesIO()
    (np.savez_compressed if compress else np.savez)(file, allow_pickle=False, **arrays)
    return file.getvalue()


@pytest.mark.parametrize("file", ["silo.npz", "silo-colors.npz"])
def test_archives_of_the_service_are_read_in_one_pass(
    file: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    content = (FOLDER / file).read_bytes()
    expected = load(content)
    monkeypatch.delattr(npz, "_load")
    arrays = npz.read_arrays(content)
    assert list(arrays) == list(expected)
    for name, array in arrays.items():
        assert array.dtype == expected[name].dtype
        np.testing.assert_array_equal(array, expected[name])
        assert array.flags.writeable


@pytest.mark.parametrize("compress", [False, True])
def test_other_archives_are_read_by_numpy(compress: bool) -> None:
    columns = np.asfortranarray(np.arange(6.0).reshape(2, 3))
    content = write(compress=compress, **ARRAYS, columns=columns, big=np.ones(2, ">f8"))
    arrays = npz.read_arrays(content)
    for name, expected in load(content).items():
        np.testing.assert_array_equal(arrays[name], expected)


@pytest.mark.parametrize("end", [0, 10, 200, 1000, -30, -1])
def test_incomplete_archives_are_refused(end: int) -> None:
    content = (FOLDER / "silo.npz").read_bytes()
    with pytest.raises((ValueError, EOFError, BadZipFile)):
        npz.read_arrays(content[:end])


def test_objects_are_refused() -> None:
    file = BytesIO()
    np.savez(file, objects=np.array([object], dtype=object))
    with pytest.raises(ValueError, match="allow_pickle"):
        npz.read_arrays(file.getvalue())
