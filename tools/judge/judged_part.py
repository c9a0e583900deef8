"""A part that is ready to be judged: its samples, the gaps of its edges, and the service to ask."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from pydantic import TypeAdapter

from oracles.brep_documents import Array, Index
from oracles.part_search import PartSearch
from oracles.parts import INSIDE, UNSURE, Answers, Part, iterate_members, place, read_part
from service.engine.brep.preparation.prepare import prepare
from service.engine.parts.border_nets import build_border_nets
from service.engine.parts.build import build_part
from service.schemas.surfaces import SurfaceDefinition
from service.settings.values import Settings
from service.surface.brep_model import BrepModel
from service.surface.lowered import GroupModel
from tools.certify.part_documents import Document
from tools.client import Client
from tools.judge.part_cases import Case

SAMPLES = 40_000
"""Samples of all faces of a part together, about."""

ROUNDING = 4e-16
"""Errors of the judge, as a share of coordinates."""

ON_PART = 1e-13
"""How far a reported point may be from the part, as a share of the largest coordinate."""

FORM = 1e-14
"""How far a solid may be from its closed form: its weights are rounded."""

GAP_ROUNDING = 2.0**-42
"""Share of the largest coordinate that the service adds to gaps."""

TUBE_SLACK = 1e-8
"""Share of the diagonal by which the boxes of edges are larger: the thickness of rays, and more."""

NEAR = 2.0
"""Regions of the service and of the judge may differ up to this many gaps from an edge."""


SETTINGS = Settings(request_timeout=3600)
"""The time of a request is not judged: the machine may be busy."""


class Refused(Exception):
    """The service did not answer."""


@dataclass(frozen=True, eq=False)
class JudgedPart:
    """A case with its samples, and the service that answers."""

    case: Case
    part: Part
    search: PartSearch
    client: Client

    @cached_property
    def size(self) -> float:
        """The largest coordinate."""
        return float(np.abs(self.part.corners).max())

    @cached_property
    def diagonal(self) -> float:
        """The diagonal of the box of all points and control points.

        Tolerances are relative to no larger one.
        """
        rows = [self.part.corners]
        for surface, matrix in iterate_members(self.case.document):
            edges = [each["curve"] for each in surface.get("edges", []) if each.get("curve")]
            points = [surface.get("vertices", []), *(each["control_points"] for each in edges)]
            placed = [place(np.array(each, np.longdouble), matrix) for each in points if each]
            rows += [each.astype(np.float64) for each in placed]
        return float(np.linalg.norm(np.ptp(np.concatenate(rows), axis=0)))

    def list_samples(self) -> tuple[Array, Array]:
        """Points (n, 3) of faces, and points (m, 3) of borders; both are not empty."""
        samples = np.concatenate([each.points for each in self.search.faces])
        return samples, np.concatenate([samples[:1], *(b.points for b in self.search.borders)])

    @cached_property
    def gaps(self) -> Array:
        """The largest proved gap of each face between its region and its edges, (F,)."""
        return np.asarray(self._bound_gaps[1])

    @cached_property
    def least_gaps(self) -> Array:
        """The least of the gaps of each face."""
        return np.asarray(self._bound_gaps[0])

    def find_reaches(self, positions: Array) -> Array:
        """How far rays may be from the edges and vertices that they pass, besides the thickness.

        For positions (m, 3): the largest radius of the tubes and balls in which the engine closes
        gaps, of those whose boxes contain the position.
        """
        low, high, radii = self._tubes
        slack = NEAR * radii[:, np.newaxis] + TUBE_SLACK * self.diagonal
        result = np.zeros(len(positions))
        for number, position in enumerate(positions):
            is_near = ((position >= low - slack) & (position <= high + slack)).all(axis=1)
            result[number] = radii[is_near].max(initial=0.0)
        return result

    @cached_property
    def _tubes(self) -> tuple[Array, Array, Array]:
        """The boxes (N, 3) about the engine's nets of edges and vertices, and their radii (N,)."""
        model = validate(self.case.document).to_surface().lower()
        assert isinstance(model, BrepModel | GroupModel)
        borders = build_border_nets(build_part(model))
        if borders is None:
            return np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0)
        nets = borders.nets
        boxes = []
        for group in nets.groups:
            points = group.values[:, :, :3]
            if group.values.shape[2] == 4:
                points = points / group.values[:, :, 3:]
            boxes.append([points.min(axis=(0, 1)).T, points.max(axis=(0, 1)).T])
        low, high = (
            nets.origin + nets.scale * np.concatenate(each) for each in zip(*boxes, strict=True)
        )
        return low, high, borders.reach * nets.scale

    @cached_property
    def _bound_gaps(self) -> Array:
        """The least and the largest gap of each face, (2, F).

        They are all that the judge takes from the engine: how far their regions may differ.
        """
        rows = [np.zeros((2, 0))]
        for surface, matrix in iterate_members(self.case.document):
            if surface.get("type", "bezier") != "brep":
                rows.append(np.zeros((2, 1)))
                continue
            model = validate(surface).to_surface().lower()
            assert isinstance(model, BrepModel)
            prepared = prepare(model)
            count, is_border = len(surface["faces"]), prepared.is_border
            face, gap = prepared.coedge_faces[is_border], prepared.close_gaps[is_border]
            least, largest = np.full(count, np.inf), np.zeros(count)
            np.minimum.at(least, face, gap)
            np.maximum.at(largest, face, gap)
            least = np.where(np.isfinite(least), least, 0.0)
            stretch = np.linalg.svd(matrix[:3, :3], compute_uv=False)
            rows.append(np.stack([least * stretch[-1], largest * stretch[0]]))
        return np.concatenate(rows, axis=1) + GAP_ROUNDING * self.size

    def ask(self, path: str, **fields: Any) -> Document:
        """The answer of the service to a question to this part; raises `Refused`."""
        response = self.client.post(f"/v1/{path}", {"surface": self.case.document, **fields})
        if response.status_code != 200:
            raise Refused(f"{path}: {response.status_code} {response.text[:300]}")
        answer: Document = response.json()
        return answer

    def classify(self, face: Index, places: Array, points: Array) -> tuple[Answers, Array]:
        """Whether places (m, 2) of faces (m,) are in the regions, and distances from borders (m,).

        A place is unsure at most `NEAR` gaps from a border, or where the judge cannot decide.
        Distances above this are not exact.
        """
        answers = np.full(len(face), UNSURE, np.int8)
        reach = NEAR * self.gaps[face]
        distances = self.search.measure_to_borders(face, points, reach)
        for k in np.unique(face):
            rows = np.flatnonzero(face == k)
            answers[rows] = self.part.faces[k].find_inside(places[rows])
        answers[distances <= reach] = UNSURE
        return answers, distances

    def find_nearest(self, points: Array) -> Array:
        """The least distances (m,) of points (m, 3) that were found.

        Points of faces count that are certainly inside, and all points of edges.
        """
        nearest = self.search.find_nearest(points)
        result = nearest.of_borders.copy()
        rows = np.flatnonzero(nearest.of_faces < result)
        face, places = nearest.faces[rows], nearest.places[rows]
        answers, _ = self.classify(face, places, self.evaluate(face, places))
        rows = rows[answers == INSIDE]
        result[rows] = nearest.of_faces[rows]
        return result

    def evaluate(self, face: Index, places: Array) -> Array:
        """Points (m, 3) of faces (m,) at places (m, 2)."""
        points = np.zeros((len(face), 3))
        for k in np.unique(face):
            rows = face == k
            points[rows] = self.part.faces[k].at(places[rows]).astype(np.float64)
        return points


def validate(surface: Document) -> Any:
    """The definition of a surface."""
    return TypeAdapter(SurfaceDefinition).validate_python(surface, context={})


def open_case(case: Case, client: Client, samples: int = SAMPLES) -> JudgedPart:
    """The part of a case, with its samples."""
    part = read_part(case.document, case.truth)
    return JudgedPart(case, part, PartSearch(part, samples, seed=1), client)
