"""Numbers as text: the fast encoders of arrays give texts that Python reads as equal numbers."""

import json
from dataclasses import replace

import numpy as np
import pytest

from service.bases.cache import MESH_PLANS
from service.encoders.format import EncodeOptions
from service.encoders.registry import BY_NAME
from service.encoders.text import (
    ROW_NUMBERS,
    general_lines,
    join_rows,
    json_array,
    json_document,
)
from service.engine.options import MeshOptions
from service.pipeline.mesh import build_mesh
from service.surface.examples.catalogue import find

RANDOM = np.random.default_rng(3)
RANDOM_BITS = RANDOM.integers(0, 2**64, 20_000, dtype=np.uint64).view(np.float64)
DECIMALS = RANDOM.integers(-(10**7), 10**7, 20_000) / 10.0 ** RANDOM.integers(0, 12, 20_000)
"""Numbers of at most seven digits: a seventh digit 5 is midway between two numbers of six."""
EDGES = [-0.0, 1e6, 999999.5, 999999.4, 9.99996e-5, 0.0001, 1.000005, 100000.5, 5e-324]
"""Numbers that `%g` writes with an exponent or just without, or rounds up to a power of ten."""
NUMBERS = np.concatenate(
    (EDGES, RANDOM_BITS[np.isfinite(RANDOM_BITS)], DECIMALS, np.nextafter(DECIMALS, 1))
)
NUMBERS = NUMBERS[: len(NUMBERS) // 3 * 3].reshape(-1, 3)


def test_six_digits_are_the_same_as_in_the_format_g_of_c() -> None:
    expected = [b"%g %g %g" % tuple(row) for row in NUMBERS.tolist()]
    assert general_lines(NUMBERS) == expected


def test_lines_have_the_numbers_of_their_rows_with_all_bits() -> None:
    single = np.clip(NUMBERS, -1e38, 1e38).astype(np.float32)
    words = [line.split(b" ") for line in join_rows(NUMBERS, single, start=b"v ").splitlines()]
    assert {(len(row), row[0]) for row in words} == {(7, b"v")}
    table = np.array([row[1:] for row in words])
    assert table[:, :3].astype(np.float64).tobytes() == NUMBERS.tobytes()
    assert table[:, 3:].astype(np.float32).tobytes() == single.tobytes()


@pytest.mark.parametrize(
    "count", [0, 1, ROW_NUMBERS, ROW_NUMBERS + 1, 2 * ROW_NUMBERS, 81 * ROW_NUMBERS + 9]
)
def test_long_rows_of_the_longest_numbers_are_written(count: int) -> None:
    """orjson gets at most `ROW_NUMBERS` numbers in a row: more would not fit into its buffer."""
    array = -1.2345678901234567e-300 * (1 + np.arange(2.0 * count).reshape(2, count) / 1e6)
    assert json.loads(json_array(array)) == array.tolist()
    # `bytes` are JSON already.
    value = {"array": array[0], "strided": array[:, ::2], "json": b"[1]", "number": array.sum()}
    plain = {"array": array[0].tolist(), "strided": array[:, ::2].tolist(), "json": [1]}
    assert json.loads(json_document(value)) == plain | {"number": float(array.sum())}


@pytest.mark.parametrize("name", ["json", "obj", "off", "oogl", "ply", "stl"])
def test_cached_faces_change_no_byte(name: str) -> None:
    """The text of faces is cached with the plan; other meshes with the same plan use it too."""
    fmt, options = BY_NAME[name], EncodeOptions("off" if name == "oogl" else None)
    mesh = build_mesh(find("utah-teapot").surface().lower(), MeshOptions(resolution=(4, 4)), fmt)
    moved_mesh = replace(mesh, positions=mesh.positions + mesh.positions.dtype.type(1))
    MESH_PLANS.clear()
    without_cache, with_cache, moved_with_cache = (
        fmt.encode(each, options) for each in (mesh, mesh, moved_mesh)
    )
    MESH_PLANS.clear()
    moved_without_cache = fmt.encode(moved_mesh, options)
    assert without_cache == with_cache
    assert moved_without_cache == moved_with_cache != without_cache
