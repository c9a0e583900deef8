"""Uniform grids of parameters by geomdl or splinepy, which have no tolerance of distances.

    python -m tools.judge_peers.makers.grids geomdl | splinepy

The file of a surface is a .npz with the arrays of nets, of which the names begin with the number of
the net: `net` (n, m, 3), `weights` (n, m), `degree` (2,), `knots_u` and `knots_v`. Each net has
`divisions` of its domain in each direction. Nets are meshed one after the other, and not joined.
"""

import sys
from collections.abc import Callable
from importlib.metadata import version
from typing import Any

import numpy as np

from tools.judge_peers.makers.protocol import Fields, Mesher, serve


def load_nets(request: Fields, build: Callable[[Fields, int], Mesher]) -> Mesher:
    """Builds the surfaces of a library for all nets of a file."""
    nets: dict[str, Fields] = {}
    for key, value in np.load(request["file"]).items():
        number, _, name = key.partition(" ")
        nets.setdefault(number, {})[name] = value
    meshers = [build(net, request["divisions"]) for net in nets.values()]

    def mesh() -> tuple[Any, Any]:
        meshes = [each() for each in meshers]
        counts = np.cumsum([0, *(len(vertices) for vertices, _ in meshes)])
        faces = [rows + first for (_, rows), first in zip(meshes, counts, strict=False)]
        return np.concatenate([vertices for vertices, _ in meshes]), np.concatenate(faces)

    return mesh


def load_geomdl(net: Fields, divisions: int) -> Mesher:
    """The surface of a net, and its `tessellate`."""
    from geomdl import NURBS  # noqa: PLC0415

    surface = NURBS.Surface()
    surface.degree_u, surface.degree_v = net["degree"].tolist()
    weights = net["weights"][..., np.newaxis]
    points = np.concatenate([net["net"] * weights, weights], axis=-1)
    surface.set_ctrlpts(points.reshape(-1, 4).tolist(), *points.shape[:2])
    surface.knotvector_u, surface.knotvector_v = net["knots_u"].tolist(), net["knots_v"].tolist()
    surface.sample_size_u = surface.sample_size_v = divisions + 1

    def mesh() -> tuple[Any, Any]:
        surface.tessellate()
        return (
            np.array([vertex.data for vertex in surface.vertices]),
            np.array([face.data for face in surface.faces]),
        )

    return mesh


def load_splinepy(net: Fields, divisions: int) -> Mesher:
    """The surface of a net, and its `extract.faces`, whose quads are divided."""
    import splinepy  # noqa: PLC0415

    # In splinepy's order, the index of the first parameter varies fastest.
    points = net["net"].transpose(1, 0, 2).reshape(-1, 3)
    weights = net["weights"].T.reshape(-1, 1)
    knots = [net["knots_u"].tolist(), net["knots_v"].tolist()]
    surface = splinepy.NURBS(net["degree"].tolist(), knots, points, weights)

    def mesh() -> tuple[Any, Any]:
        faces = surface.extract.faces([divisions + 1] * 2)
        a, b, c, d = np.asarray(faces.faces).T
        rows = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
        vertices = np.asarray(faces.vertices)
        # Quads at a pole have equal corners, because `extract.faces` merges equal vertices.
        is_triangle = (np.diff(np.sort(rows, axis=1), axis=1) > 0).all(axis=1)
        return vertices, rows[is_triangle]

    return mesh


if __name__ == "__main__":
    library = sys.argv[1]
    build = {"geomdl": load_geomdl, "splinepy": load_splinepy}[library]
    serve(f"{library} {version(library)}", lambda request: load_nets(request, build))
