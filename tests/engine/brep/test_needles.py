"""Cylinders much thinner than long, or much wider than high: closed meshes, without false gaps."""

from dataclasses import replace
from math import sqrt
from typing import Any

import numpy as np
import pytest

from oracles.solids import read_solid
from service.engine.adaptive.limits import MeshLimits
from service.engine.bounds.goal import Goal
from service.engine.brep.brep_triangulation import BrepTriangulation
from service.engine.brep.meshing import triangulate_brep
from service.engine.brep.preparation.prepare import prepare
from service.engine.brep.report import are_borders_in_mesh
from tests.engine.brep.solid_documents import count_cracks, lower

KNOTS = [0, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 4]
WEIGHTS = [1, sqrt(0.5)] * 4 + [1]
RING = [(1, 0), (1, 1), (0, 1), (-1, 1), (-1, 0), (-1, -1), (0, -1), (1, -1), (1, 0)]


def build_circle(radius: float, height: float) -> dict[str, Any]:
    points = [[radius * x, radius * y, height] for x, y in RING]
    return {"type": "bspline", "degree": 2, "knots": KNOTS, "control_points": points,
            "weights": WEIGHTS}  # fmt: skip


def build_disc(size: float, height: float, *, up: bool) -> dict[str, Any]:
    net = [[[x * size, y * size, height] for y in (-2, 2)] for x in (-2, 2)]
    return {"control_net": net if up else [list(column) for column in zip(*net, strict=True)]}


def build_cylinder(radius: float, height: float, *, pcurves: bool) -> dict[str, Any]:
    """A closed cylinder of three faces, without a seam."""
    rings = [build_circle(radius, z) for z in (0.0, height)]
    nets = zip(*(ring["control_points"] for ring in rings), strict=True)
    loops: list[dict[str, Any]] = [{"edges": [0]}, {"edges": [1], "reversed": [True]}]
    for loop, v in zip(loops, (0, 1), strict=True):
        if pcurves:
            loop["pcurves"] = [
                {"type": "bspline", "degree": 1, "knots": [0, 0, 4, 4],
                 "control_points": [[0, v], [4, v]]}
            ]  # fmt: skip
    side = {"type": "bspline", "degree": [2, 1], "knots": [KNOTS, [0, 0, 1, 1]],
            "control_net": [list(pair) for pair in nets],
            "weights": [[w, w] for w in WEIGHTS]}  # fmt: skip
    bottom, top = build_disc(radius, 0.0, up=False), build_disc(radius, height, up=True)
    return {
        "type": "brep",
        "vertices": [[radius, 0, 0], [radius, 0, height]],
        "edges": [{"vertices": [k, k], "curve": ring} for k, ring in enumerate(rings)],
        "faces": [
            {"surface": side, "loops": loops},
            {"surface": bottom, "loops": [{"edges": [0], "reversed": [True]}]},
            {"surface": top, "loops": [{"edges": [1]}]},
        ],
        "shells": [{"faces": [0, 1, 2], "closed": True}],
    }


@pytest.mark.parametrize("pcurves", [False, True])
@pytest.mark.parametrize(
    ("radius", "height"), [(1e-6, 1e3), (1e-4, 1e3), (1e3, 1e-6), (1e3, 1e-4), (1.0, 1.0)]
)
def test_thin_cylinders_are_closed(radius: float, height: float, *, pcurves: bool) -> None:
    prepared = prepare(lower(build_cylinder(radius, height, pcurves=pcurves)))
    assert not prepared.skipped_faces
    assert prepared.gaps.max() < 1e-8 * prepared.diagonal
    found = triangulate_brep(prepared, Goal(1e-3 * prepared.diagonal), MeshLimits())
    assert set(found.faces.tolist()) == {0, 1, 2}
    assert found.bound <= 1e-3 * prepared.diagonal
    assert not count_cracks(prepared)


def drop_faces(found: BrepTriangulation, *faces: int) -> BrepTriangulation:
    """The mesh without the triangles of some faces."""
    kept = ~np.isin(found.faces, faces)
    return replace(found, triangles=found.triangles[kept], faces=found.faces[kept])


def test_faces_without_triangles_are_bounded_by_the_edges_that_others_have() -> None:
    prepared = prepare(lower(read_solid("box")))
    found = triangulate_brep(prepared, Goal(0.01 * prepared.diagonal), MeshLimits())
    assert are_borders_in_mesh(prepared, found, [])
    assert are_borders_in_mesh(prepared, drop_faces(found, 2), [])
    every = range(6)
    assert not are_borders_in_mesh(prepared, drop_faces(found, *every), [])
    beside = [
        face
        for face in every
        if face and not are_borders_in_mesh(prepared, drop_faces(found, 0, face), [])
    ]
    assert len(beside) == 4  # they share an edge with face 0
    assert are_borders_in_mesh(prepared, drop_faces(found, *every), list(every))
    assert are_borders_in_mesh(prepared, drop_faces(found, 0, beside[0]), [beside[0]]) is False
