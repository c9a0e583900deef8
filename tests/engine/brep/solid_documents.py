"""Solids as documents without parameter curves or seams, and the cracks of their meshes."""

from typing import Any

import numpy as np

from service.engine.adaptive.limits import Effort, MeshLimits
from service.engine.bounds.goal import Goal
from service.engine.brep.meshing import triangulate_brep
from service.engine.brep.prepared import PreparedBrep
from service.schemas.request import MeshRequest
from service.schemas.validation import validate_document
from service.surface.brep import BrepSurface
from service.surface.brep_model import BrepModel

Document = dict[str, Any]


def lower(document: Document) -> BrepModel:
    surface = validate_document(MeshRequest, {"surface": document}).to_surface()
    assert isinstance(surface, BrepSurface)
    return surface.lower()


def strip_pcurves(document: Document) -> Document:
    """The brep without parameter curves and poles: faces have edges alone."""
    for face in document["faces"]:
        for loop in face["loops"]:
            poles = [bool(document["edges"][e].get("degenerate")) for e in loop["edges"]]
            is_reversed = loop.get("reversed", [False] * len(poles))
            loop["reversed"] = [r for r, pole in zip(is_reversed, poles, strict=True) if not pole]
            loop["edges"] = [e for e, pole in zip(loop["edges"], poles, strict=True) if not pole]
            loop.pop("pcurves", None)
        face["loops"] = [loop for loop in face["loops"] if loop["edges"]]
    return document


def strip_seams(document: Document) -> Document:
    """The brep without parameter curves, and without edges that one face has twice."""
    document = strip_pcurves(document)
    for face in document["faces"]:
        edges = [e for loop in face["loops"] for e in loop["edges"]]
        sides = [
            (e, r)
            for loop in face["loops"]
            for e, r in zip(loop["edges"], loop["reversed"], strict=True)
            if edges.count(e) == 1
        ]
        face["loops"] = []
        while sides:
            chain = [sides.pop(0)]
            ends = [document["edges"][e]["vertices"][:: -1 if r else 1] for e, r in chain]
            while ends[-1][1] != ends[0][0]:
                following = next(
                    side
                    for side in sides
                    if document["edges"][side[0]]["vertices"][-1 if side[1] else 0] == ends[-1][1]
                )
                sides.remove(following)
                chain.append(following)
                e, r = following
                ends.append(document["edges"][e]["vertices"][:: -1 if r else 1])
            face["loops"].append(
                {"edges": [e for e, _ in chain], "reversed": [r for _, r in chain]}
            )
    return document


def count_cracks(prepared: PreparedBrep) -> int:
    """Directed edges of a coarse mesh that do not occur as often as their reverses."""
    limits = MeshLimits(100_000, Effort())
    mesh = triangulate_brep(prepared, Goal(tolerance=0.02 * prepared.diagonal), limits)
    corners = mesh.points[mesh.triangles]
    a, b = np.concatenate([corners[:, [0, 1]], corners[:, [1, 2]], corners[:, [2, 0]]]).T
    count = len(mesh.positions)
    forward, backward = np.sort(a * count + b), np.sort(b * count + a)
    assert len(forward)
    return int((forward != backward).sum())
