"""One net through every door: JSON, NumPy's file, OOGL, the text of the teapot.

From the bytes to the document, which is what a parser is compared with, and on to the surface,
whose values are checked at birth whatever door they came through.
"""

import io
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, TypeAlias

import numpy as np
import orjson
from numpy.typing import NDArray

from service.decoders.registry import BY_NAME
from service.schemas.document import DocumentLimits, parse_document
from service.schemas.request import MeshRequest
from service.schemas.validation import validate_document
from service.surface import Surface
from tools.benchmarks.alternately import alternately

Door: TypeAlias = Callable[[], object]

LIMITS = DocumentLimits()


def run() -> None:
    """Prints a table: microseconds by door, and how many times faster than JSON that is."""
    print("a net to a request (µs, and times JSON), and on to its surface")
    for rows, columns in ((4, 4), (100, 100), (500, 500)):
        _table(f"{rows} × {columns}", _of_net(rows, columns))
    for patches in (32, 10_000):
        _table(f"{patches} × 4 × 4", _of_patches(patches))


def _table(title: str, doors: Mapping[str, Door]) -> None:
    read = alternately({name: partial(_read, door) for name, door in doors.items()}, 7)
    born = alternately({name: partial(_born, door) for name, door in doors.items()}, 7)
    for name in doors:
        print(
            f"{title:>13}  {name:6} {read[name] * 1e6:10.0f} {read['json'] / read[name]:6.1f}"
            f"   surface {born[name] * 1e6:10.0f} {born['json'] / born[name]:6.1f}"
        )


def _read(door: Door) -> MeshRequest:
    return validate_document(MeshRequest, door(), LIMITS)


def _born(door: Door) -> Surface:
    return _read(door).to_surface()


def _of_net(rows: int, columns: int) -> dict[str, Door]:
    net = np.random.default_rng(1).normal(size=(rows, columns, 3))
    surface = {"type": "bspline", "control_net": net.tolist()}
    return {
        "json": _json(surface),
        "npy f8": _file("npy", _saved(net), "bspline"),
        "npy f4": _file("npy", _saved(net.astype(np.float32)), "bspline"),
    }


def _of_patches(count: int) -> dict[str, Door]:
    nets = np.random.default_rng(2).normal(size=(count, 4, 4, 3))
    own = np.arange(count * 16).reshape(count, 4, 4)
    vertices = nets.reshape(-1, 3)
    surface = {"type": "patches", "vertices": vertices.tolist(), "patches": own.tolist()}
    numbers = ["\n".join(" ".join(map(repr, point)) for point in vertices.tolist())]
    lines = [str(count), *(",".join(map(str, grid.ravel())) for grid in own + 1)]
    text = "\n".join([*lines, str(len(vertices)), *numbers])
    return {
        "json": _json(surface),
        "npy": _file("npy", _saved(nets), "patches"),
        "oogl": _file("oogl", f"BBP\n{numbers[0]}".encode(), None),
        "teapot": _file("teapot", text.encode(), None),
    }


def _json(surface: object) -> Door:
    body = orjson.dumps({"surface": surface})
    return lambda: parse_document(body)


def _file(name: str, content: bytes, kind: str | None) -> Door:
    decode = BY_NAME[name].decode
    return lambda: {"surface": decode(content, kind, LIMITS.max_control_points)}


def _saved(array: NDArray[Any]) -> bytes:
    file = io.BytesIO()
    np.save(file, array)
    return file.getvalue()
