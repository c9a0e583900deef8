"""Parts as documents, and the meshes of these: the proof that directions are right."""

from typing import Any

import numpy as np

from oracles.breps import count_cracks
from oracles.topology import volume
from service.decoders.cad.content import Curve, Part, Surface
from service.engine.adaptive.limits import MeshLimits
from service.engine.bounds.goal import Goal
from service.engine.brep.meshing import triangulate_brep
from service.engine.brep.preparation.prepare import prepare
from service.engine.brep.prepared import PreparedBrep
from service.schemas.brep import BrepDefinition


def write_curve(curve: Curve) -> dict[str, Any]:
    weights = curve.points[:, -1]
    return {
        "type": "bspline",
        "degree": curve.degree,
        "knots": curve.knots.tolist(),
        "control_points": (curve.points[:, :-1] / weights[:, np.newaxis]).tolist(),
        "weights": weights.tolist(),
    }


def write_surface(surface: Surface) -> dict[str, Any]:
    weights = surface.points[..., 3]
    return {
        "type": "bspline",
        "degree": list(surface.degrees),
        "knots": [knots.tolist() for knots in surface.knots],
        "control_net": (surface.points[..., :3] / weights[..., np.newaxis]).tolist(),
        "weights": weights.tolist(),
    }


def write_part(part: Part) -> dict[str, Any]:
    edges: list[dict[str, Any]] = []
    for edge in part.edges:
        written: dict[str, Any] = {"vertices": list(edge.vertices)}
        if edge.is_degenerate:
            written = {"vertices": [edge.vertices[0]], "degenerate": True}
        elif edge.curve is not None:
            written["curve"] = write_curve(edge.curve)
        edges.append(written)
    faces = []
    for face in part.faces:
        loops = [
            {
                "edges": [coedge.edge for coedge in loop],
                "reversed": [coedge.is_reversed for coedge in loop],
                "pcurves": [
                    None if coedge.pcurve is None else write_curve(coedge.pcurve) for coedge in loop
                ],
            }
            for loop in face.loops
        ]
        faces.append({"surface": write_surface(face.surface), "reversed": face.is_reversed})
        if loops:
            faces[-1]["loops"] = loops
    return {
        "type": "brep",
        "vertices": part.vertices.tolist(),
        "edges": edges,
        "faces": faces,
        "shells": [{"faces": list(s.faces), "closed": s.is_closed} for s in part.shells],
    }


def prepare_part(part: Part) -> PreparedBrep:
    return prepare(BrepDefinition.model_validate(write_part(part)).to_surface().lower())


def measure_part(part: Part, share: float = 1e-3) -> tuple[float, list[tuple[int, int]]]:
    """The volume of the mesh of a part, within a share of its diagonal, and its cracks."""
    prepared = prepare_part(part)
    mesh = triangulate_brep(prepared, Goal(share * prepared.diagonal, np.inf), MeshLimits())
    assert mesh.bound <= share * prepared.diagonal
    assert prepared.gaps.max(initial=0.0) <= 1e-6 * prepared.diagonal
    triangles = mesh.points[mesh.triangles]
    return volume(mesh.positions, triangles), count_cracks(mesh.positions, triangles)
