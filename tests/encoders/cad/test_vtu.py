"""VTU: the Bézier cells have the points, weights and degrees of the patches."""

import xml.etree.ElementTree as ET

import numpy as np
import pytest

from service.encoders.cad.vtu import encode, estimate_bytes, order_grid, order_triangle
from service.engine.models import to_patches
from service.errors import InvalidRequest
from service.surface.batches import TensorPatches
from service.surface.examples.catalogue import EXAMPLES, find
from service.surface.sizes import SurfaceKind
from tests.encoders.cad.test_step import allow_any

TYPES = {"Float64": "<f8", "Int64": "<i8", "Int32": "<i4", "UInt8": "u1"}
PATCHES = [
    name
    for name, each in EXAMPLES.items()
    if not (each.surface().size().curves or each.surface().size().faces)
]


def read(surface: SurfaceKind) -> tuple[dict[str, np.ndarray], ET.Element]:
    """The arrays of a file by name, and its XML."""
    content = bytes(encode(surface.lower(), None, allow_any).content)
    head, data = content.split(b'<AppendedData encoding="raw">\n_', 1)
    root = ET.fromstring(head + b"</VTKFile>")
    arrays = {}
    for array in root.iter("DataArray"):
        begin = int(array.attrib["offset"])
        length = int.from_bytes(data[begin : begin + 8], "little")
        dtype = np.dtype(TYPES[array.attrib["type"]])
        values = np.frombuffer(data[begin + 8 : begin + 8 + length], dtype)
        columns = int(array.attrib["NumberOfComponents"])
        arrays[array.attrib["Name"]] = values.reshape(-1, columns) if columns > 1 else values
        end = begin + 8 + length
    assert data[end:] == b"\n</AppendedData>\n</VTKFile>\n"
    return arrays, root


@pytest.mark.parametrize("name", PATCHES)
def test_cells_have_the_nets_of_the_patches(name: str) -> None:
    surface = find(name).surface()
    arrays, root = read(surface)
    model = to_patches(surface.lower())
    (piece,) = root.iter("Piece")
    assert int(piece.attrib["NumberOfCells"]) == model.patch_count
    assert int(piece.attrib["NumberOfPoints"]) == len(arrays["Points"])
    assert np.array_equal(arrays["connectivity"], np.arange(len(arrays["Points"])))
    assert np.array_equal(arrays["part"], model.part_numbers)
    starts = np.concatenate([[0], arrays["offsets"]])
    cell = 0
    for batch in model.batches:
        if isinstance(batch, TensorPatches):
            (p, q), kind = batch.degree, 77
            order = order_grid(p, q)
        else:
            p, q, kind = batch.degree, batch.degree, 76
            order = order_triangle(p)
        for patch in range(batch.count):
            own = slice(starts[cell], starts[cell + 1])
            points = batch.points[patch].reshape(-1, 3)
            assert np.array_equal(arrays["Points"][own], points[order])
            if "RationalWeights" in arrays:
                weights = np.ones(len(points)) if batch.weights is None else batch.weights[patch]
                assert np.array_equal(arrays["RationalWeights"][own], weights.ravel()[order])
            assert arrays["types"][cell] == kind
            assert arrays["HigherOrderDegrees"][cell].tolist() == [p, q, 0]
            cell += 1


def test_orders_of_small_cells() -> None:
    """Corners, sides and the inside, as figures of VTK's documentation number them."""
    assert order_grid(2, 2).tolist() == [0, 6, 8, 2, 3, 7, 5, 1, 4]
    assert order_grid(3, 1).tolist() == [0, 6, 7, 1, 2, 4, 3, 5]
    assert order_triangle(1).tolist() == [0, 1, 2]
    assert order_triangle(2).tolist() == [0, 2, 5, 1, 4, 3]
    assert order_triangle(3).tolist() == [0, 3, 9, 1, 2, 6, 8, 7, 4, 5]


@pytest.mark.parametrize("degree", range(1, 9))
def test_orders_have_every_point_once(degree: int) -> None:
    grid, triangle = order_grid(degree, degree + 1), order_triangle(degree)
    assert sorted(grid.tolist()) == list(range((degree + 1) * (degree + 2)))
    assert sorted(triangle.tolist()) == list(range((degree + 1) * (degree + 2) // 2))


@pytest.mark.parametrize("name", PATCHES)
def test_bounds(name: str) -> None:
    surface = find(name).surface()
    bounds: list[int] = []
    content = encode(surface.lower(), None, bounds.append).content
    assert len(content) <= bounds[0] <= estimate_bytes(surface.size())


@pytest.mark.parametrize("name", ["gear", "trefoil-tube"])
def test_breps_and_tubes_are_refused(name: str) -> None:
    with pytest.raises(InvalidRequest) as caught:
        encode(find(name).surface().lower(), None, allow_any)
    (issue,) = caught.value.issues
    assert issue.code == "not_parametric"
    assert ("untrim" in issue.needed) == (name == "gear")
