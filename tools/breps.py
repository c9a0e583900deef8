"""Large breps for measurements: a grid of faces that share edges, and copies of a solid."""

import gzip
from copy import deepcopy
from typing import Any

import orjson

from tools.processes import ROOT

Document = dict[str, Any]

SOLIDS = ROOT / "tests" / "solids"


def load_solid(name: str) -> Document:
    """The document of one of the solids of the tests."""
    document = orjson.loads(gzip.decompress((SOLIDS / f"{name}.json.gz").read_bytes()))
    return dict(document.get("surface", document))


def build_sheet(rows: int, columns: int, *, has_pcurves: bool = False) -> Document:
    """An open shell of rows × columns bilinear faces that share their edges, which are lines."""

    def number(i: int, j: int) -> int:
        return i * (columns + 1) + j

    vertices = [
        [i, j, (i * i + 2 * j * j) % 5 / 8] for i in range(rows + 1) for j in range(columns + 1)
    ]
    along_u = [(number(i, j), number(i + 1, j)) for i in range(rows) for j in range(columns + 1)]
    along_v = [(number(i, j), number(i, j + 1)) for i in range(rows + 1) for j in range(columns)]
    square = [[0, 0], [1, 0], [1, 1], [0, 1], [0, 0]]
    sides = [square[0:2], square[1:3], [square[3], square[2]], [square[4], square[3]]]
    pcurves = [{"control_points": side} for side in sides]
    faces = []
    for i in range(rows):
        for j in range(columns):
            corners = [[vertices[number(i + k, j + m)] for m in range(2)] for k in range(2)]
            u, v = i * (columns + 1) + j, len(along_u) + i * columns + j
            loop: Document = {
                "edges": [u, v + columns, u + 1, v],
                "reversed": [False, False, True, True],
            }
            if has_pcurves:
                loop["pcurves"] = pcurves
            faces.append({"surface": {"control_net": corners}, "loops": [loop]})
    return {
        "type": "brep",
        "vertices": vertices,
        "edges": [{"vertices": list(pair)} for pair in (*along_u, *along_v)],
        "faces": faces,
    }


def repeat_solid(document: Document, copies: int) -> Document:
    """Copies of a solid at one place, as shells of one brep; with its curves and pcurves."""
    vertices, edges = len(document["vertices"]), len(document["edges"])
    faces = len(document["faces"])
    result: Document = {
        "type": "brep",
        "vertices": document["vertices"] * copies,
        "edges": [],
        "faces": [],
        "shells": [],
    }
    for copy in range(copies):
        part = deepcopy(document)
        for edge in part["edges"]:
            edge["vertices"] = [vertex + copy * vertices for vertex in edge["vertices"]]
        for face in part["faces"]:
            for loop in face.get("loops", []):
                loop["edges"] = [edge + copy * edges for edge in loop["edges"]]
        result["edges"] += part["edges"]
        result["faces"] += part["faces"]
        result["shells"] += [
            shell | {"faces": [face + copy * faces for face in shell["faces"]]}
            for shell in part["shells"]
        ]
    return result


def list_solids() -> list[str]:
    """Names of all solids of the tests."""
    return sorted(path.name.removesuffix(".json.gz") for path in SOLIDS.glob("*.json.gz"))
