"""Random breps as documents, and random changes of them, most of which make them invalid."""

import math
from contextlib import suppress
from copy import deepcopy
from typing import Any, TypeAlias

import numpy as np

from tools.breps import build_sheet, list_solids, load_solid
from tools.certify.parts import PARTS

Document: TypeAlias = dict[str, Any]
Random: TypeAlias = np.random.Generator

NUMBERS: tuple[Any, ...] = (
    0, 1, -1, 2, 3, 64, 65, 1.5, -0.0, 1e-300, 5e-324, 1e-13, 1e39, -1e39, 1e308, 2**31, 2**53,
    2**63, 2**64 - 1,
)  # fmt: skip
"""Numbers that may stand in place of any other."""

VALUES: tuple[Any, ...] = (
    None, True, False, *NUMBERS, "", "x", "bspline", "bezier", "periodic", "uniform", "clamped", [],
    [0], [0, 1], [[0, 0]], [[0, 0, 0], [1, 1, 1]], [None], [True], {}, {"type": "bspline"},
)  # fmt: skip
"""Values that may stand in place of any other."""

NAMES = (
    "type", "degree", "knots", "weights", "homogeneous", "curve", "vertices", "uncertainty", "name",
    "color", "reversed", "surface", "loops", "edges", "pcurves", "control_points", "control_net",
    "faces", "shells", "closed", "invalid_faces", "up", "vertex_uncertainties", "degenerate", "x",
)  # fmt: skip
"""Keys that may stand in any object."""

MAX_FACES = 12
"""Solids are cut to at most this number of faces, so that a mesh takes a short time."""


def draw_brep(rng: Random) -> Document:
    """A valid brep: a generated part, some faces of a solid, or a sheet; also moved and scaled."""
    kind = rng.random()
    if kind < 0.5:
        names = list(PARTS)
        document = PARTS[names[rng.integers(len(names))]].build(rng).document
    elif kind < 0.9:
        names = list_solids()
        solid = load_solid(names[rng.integers(len(names))])
        document = _take_faces(solid, rng)
    else:
        rows, columns = rng.integers(1, 4, 2).tolist()
        document = build_sheet(rows, columns, has_pcurves=bool(rng.integers(2)))
    document = deepcopy(document) | {"type": "brep"}
    if rng.random() < 0.3:
        _move(document, rng)
    if rng.random() < 0.2:
        document.pop("shells", None)  # a loop without edges is a border
        for face in document["faces"]:
            for loop in face.get("loops", []):
                if "pcurves" in loop and None not in loop["pcurves"] and "edges" in loop:
                    del loop[("pcurves", "edges")[rng.integers(2)]]
    if rng.random() < 0.3:
        document["invalid_faces"] = "skip"
    return document


def _take_faces(solid: Document, rng: Random) -> Document:
    """Some neighbouring faces of a solid in the file, with all its edges and vertices."""
    count = len(solid["faces"])
    if count <= MAX_FACES and rng.random() < 0.5:
        return solid
    first = int(rng.integers(count))
    faces = solid["faces"][first : first + int(rng.integers(1, MAX_FACES + 1))]
    return {key: value for key, value in solid.items() if key != "shells"} | {"faces": faces}


def _move(document: Document, rng: Random) -> None:
    """Rotates, mirrors, scales and moves all points of space of a document."""
    matrix, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    scale = float(10.0 ** rng.integers(-6, 7))
    shift = rng.normal(size=3) * scale * 10.0 ** rng.integers(-1, 5)

    def place(points: Any) -> Any:
        return (np.asarray(points) @ matrix * scale + shift).tolist()

    document["vertices"] = place(document["vertices"]) if document.get("vertices") else []
    for edge in document.get("edges", []):
        if "curve" in edge:
            edge["curve"]["control_points"] = place(edge["curve"]["control_points"])
        if "uncertainty" in edge:
            edge["uncertainty"] *= scale
    for face in document["faces"]:
        face["surface"]["control_net"] = place(face["surface"]["control_net"])
    for key in ("uncertainty", "vertex_uncertainties"):
        if key in document:
            document[key] = (np.asarray(document[key]) * scale).tolist()


def mutate(document: Document, rng: Random) -> None:
    """Changes one value somewhere in a document: geometry, topology, or the form."""
    kind = rng.random()
    if kind < 0.5:
        _change_number(document, rng)
    elif kind < 0.85:
        # After a change of the form there may be no such lists.
        with suppress(TypeError, KeyError, AttributeError, IndexError, ValueError):
            _change_topology(document, rng)
    else:
        _change_form(document, rng)


def _change_number(document: Document, rng: Random) -> None:
    """Changes one number of a curve, a net or a vertex: by a little, by much, or to a special."""
    holder, key = _walk(document, rng, deepest=True)
    value = holder[key]
    if isinstance(value, bool) or not isinstance(value, int | float):
        return
    choice = rng.integers(5)
    if choice == 0:
        holder[key] = value * (1 + float(10 ** rng.uniform(-15, 0)) * float(rng.normal()))
    elif choice == 1:
        holder[key] = value + float(rng.normal() * 10 ** rng.uniform(-12, 3))
    elif choice == 2:
        holder[key] = NUMBERS[rng.integers(len(NUMBERS))]
    elif choice == 3 and len(holder) > 1 and isinstance(holder, list):
        holder[key] = holder[int(rng.integers(len(holder)))]
    else:
        holder[key] = -value
    if isinstance(holder[key], float) and not math.isfinite(holder[key]):
        holder[key] = 0.0


def _change_topology(document: Document, rng: Random) -> None:
    """Changes edges, loops, faces and shells, but keeps a valid form."""
    edges, faces = document.get("edges", []), document["faces"]
    face = faces[rng.integers(len(faces))] if faces else {}
    loops = face.get("loops", []) if isinstance(face, dict) else []
    loop = loops[rng.integers(len(loops))] if isinstance(loops, list) and loops else None
    match int(rng.integers(10)):
        case 0 if edges:
            edge = edges[rng.integers(len(edges))]
            edge["vertices"] = [int(rng.integers(len(document["vertices"]) + 1)) for _ in range(2)]
        case 1 if loop and loop.get("edges"):
            loop["edges"][rng.integers(len(loop["edges"]))] = int(rng.integers(len(edges) + 1))
        case 2 if loop and loop.get("reversed"):
            position = rng.integers(len(loop["reversed"]))
            loop["reversed"][position] = not loop["reversed"][position]
        case 3 if loop:
            loops.append(deepcopy(loop))
        case 4 if loop:
            for values in loop.values():
                values.reverse()
        case 5:
            face["reversed"] = not face.get("reversed", False)
        case 6 if loop:
            loops.remove(loop)
        case 7 if loop and loop.get("pcurves"):
            loop["pcurves"][rng.integers(len(loop["pcurves"]))] = None
        case 8:
            document["shells"] = [{"faces": [*range(len(faces))], "closed": bool(rng.integers(2))}]
        case _:
            other = faces[rng.integers(len(faces))]
            face["surface"], other["surface"] = other["surface"], face["surface"]


def _change_form(document: Document, rng: Random) -> None:
    """Replaces, removes, repeats or adds a value of any kind."""
    holder, key = _walk(document, rng, deepest=False)
    match int(rng.integers(4)):
        case 0:
            holder[key] = deepcopy(VALUES[rng.integers(len(VALUES))])
        case 1:
            del holder[key]
        case 2 if isinstance(holder, list):
            holder.insert(key, deepcopy(holder[key]))
        case 2:
            holder[NAMES[rng.integers(len(NAMES))]] = deepcopy(holder[key])
        case _ if isinstance(holder, dict):
            holder[NAMES[rng.integers(len(NAMES))]] = deepcopy(VALUES[rng.integers(len(VALUES))])
        case _:
            holder.append(deepcopy(VALUES[rng.integers(len(VALUES))]))


def _walk(document: Document, rng: Random, *, deepest: bool) -> tuple[Any, Any]:
    """A random place in a document, as an object or list and a key of it; or a number, deepest."""
    holder: Any = document
    while True:
        keys = list(holder) if isinstance(holder, dict) else range(len(holder))
        if deepest:
            inner = [k for k in keys if isinstance(holder[k], dict | list) and holder[k]]
            keys = inner or keys
        key = keys[int(rng.integers(len(keys)))]
        value = holder[key]
        if isinstance(value, dict | list) and value and (deepest or rng.random() < 0.75):
            holder = value
            continue
        return holder, key
