"""The borders of the faces of a part: edges as curves of space, and the images of coedges.

The image of a coedge is the curve S(c(t)), the border of the region of its face on the surface of
the face. It has the parameters of the edge, and is no further from it than the gap of the coedge.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from service.bases.arrays import AnyArray, Bools, FloatArray, Ints
from service.bases.bernstein import bernstein
from service.engine.brep.prepared import PreparedBrep
from service.engine.parts.copies import BrepCopy, Members
from service.engine.parts.part import Part
from service.engine.sections.cells import THICKNESS, LocalPlanes
from service.engine.trims.closure import ClosedSurfaces
from service.engine.trims.composition import compose_curves
from service.engine.trims.inside import OUTSIDE
from service.engine.trims.places import SIZE
from service.engine.trims.span_nets import Intervals
from service.engine.trims.splines import Splines

GOAL = 2.0**-40
"""The greatest error of images that are interpolated, as a share of the diagonal of the brep."""


@dataclass(frozen=True, eq=False)
class CurvePieces:
    """P Bézier pieces of curves, in the coordinates of the nets; those of a curve ascend.

    Attributes
    ----------
    curve : ndarray of int, shape (P,)
        The curve of each piece, never decreasing.
    low, high : ndarray of float64, shape (P,)
        Parameters of the curve.
    groups : tuple of (ndarray of int (r,), ndarray of float64 (n+1, 4, r))
        For each degree the pieces and their homogeneous nets. The largest weight of a net is 1.
    """

    curve: Ints
    low: FloatArray
    high: FloatArray
    groups: tuple[tuple[Ints, FloatArray], ...]

    @property
    def numbers(self) -> int:
        """How many control points all pieces have."""
        return sum(values.shape[0] * values.shape[2] for _, values in self.groups)

    @cached_property
    def _places(self) -> tuple[Ints, Ints]:
        """The group of each piece, and its column there, (P,) each."""
        group, column = np.empty((2, len(self.curve)), np.intp)
        for number, (rows, _) in enumerate(self.groups):
            group[rows], column[rows] = number, np.arange(len(rows))
        return group, column

    def split(self, piece: Ints) -> Iterator[tuple[Ints, FloatArray]]:
        """The indices in `piece` (m,) of the pieces of each group, and their nets (n+1, 4, r)."""
        group, column = self._places
        for number, (_, values) in enumerate(self.groups):
            rows = (group[piece] == number).nonzero()[0]
            if len(rows):
                yield rows, values.take(column[piece[rows]], axis=2)

    def evaluate(self, piece: Ints, share: FloatArray) -> FloatArray:
        """Points (m, 3) of pieces (m,) at parameters from 0 to 1."""
        points = np.empty((len(piece), 3))
        for rows, values in self.split(piece):
            basis = bernstein(len(values) - 1, share[rows])
            point = np.einsum("rk,kdr->rd", basis, values)
            points[rows] = point[:, :3] / point[:, 3:]
        return points

    def find(self, curve: Ints, t: FloatArray) -> tuple[Ints, FloatArray]:
        """The pieces (m,) of curves at parameters t (m,), and the shares (m,) of these in them."""
        first, last = (
            np.searchsorted(self.curve, curve),
            np.searchsorted(self.curve, curve, "right"),
        )
        piece = first.copy()
        while True:
            is_after = (piece + 1 < last) & (t > self.high[piece])
            if not is_after.any():
                break
            piece += is_after
        width = self.high[piece] - self.low[piece]
        share = (t - self.low[piece]) / np.where(width > 0, width, 1.0)
        return piece, np.clip(share, 0.0, 1.0)


def measure_heights(
    values: FloatArray, planes: LocalPlanes, plane: Ints
) -> tuple[FloatArray, FloatArray]:
    """Coefficients f = w h of the heights h of nets (n+1, 4, r) over planes, and their weights.

    Parameters
    ----------
    plane : ndarray of int, shape (r,) or (m,)
        For each net its plane; the results are (n+1, r). If `values` has the shape (n+1, 4, r, 1),
        all pairs: (n+1, r, m), and the weights (n+1, r, 1).
    """
    x, y, z = planes.normals[plane].T
    weights = values[:, 3]
    heights = values[:, 0] * x + values[:, 1] * y + values[:, 2] * z
    heights -= weights * planes.offsets[plane]
    return heights, weights


def clear_heights(heights: FloatArray, weights: FloatArray) -> FloatArray:
    """The heights after those of at most `THICKNESS` have become 0."""
    heights[np.abs(heights) <= THICKNESS * weights] = 0.0
    return heights


@dataclass(frozen=True, eq=False)
class Borders:
    """The borders of a part: F faces and patches, V vertices, E edges and C coedges, in loops.

    Lengths are in the coordinates of the nets.

    Attributes
    ----------
    members : Members
        With B copies of breps.
    first_coedge : ndarray of int, shape (B + 1,)
        The coedges of copy b are `first_coedge[b]` … `first_coedge[b + 1]` − 1.
    is_reversed : ndarray of bool, shape (F,)
        Whether the normal of the face is −(du × dv).
    vertices : ndarray of float64, shape (V, 3)
    edge_vertices : ndarray of int, shape (E, 2)
    edge_ranges : ndarray of float64, shape (E, 2)
    edge_gaps : ndarray of float64, shape (E,)
        The largest gap of the coedges of an edge.
    is_point : ndarray of bool, shape (E,)
        Whether an edge is one point: a pole.
    edges : CurvePieces
        Of all edges that are not points.
    coedge_edges, coedge_faces, coedge_loops : ndarray of int, shape (C,)
    coedge_reversed : ndarray of bool, shape (C,)
    images : CurvePieces
        Of all coedges.
    """

    members: Members
    first_coedge: Ints
    is_reversed: Bools
    vertices: FloatArray
    edge_vertices: Ints
    edge_ranges: FloatArray
    edge_gaps: FloatArray
    is_point: Bools
    edges: CurvePieces
    coedge_edges: Ints
    coedge_faces: Ints
    coedge_loops: Ints
    coedge_reversed: Bools
    images: CurvePieces

    @classmethod
    def of(cls, part: Part) -> "Borders":
        """The borders of all breps of a part."""
        origin, scale = part.nets.origin, part.nets.scale
        members = part.members
        columns: dict[str, list[AnyArray]] = {}
        edges, images = [], []
        vertices = edge_count = coedge_count = loops = 0
        first_coedge = [0]
        definitions = [_list_curves(prepared) for prepared in members.definitions]
        for copy in members.copies:
            prepared = members.definitions[copy.definition]
            count = len(prepared.coedge_edges)
            gaps = np.zeros(len(prepared.edge_vertices))
            np.maximum.at(gaps, prepared.coedge_edges, prepared.close_gaps)
            rows: dict[str, AnyArray] = {
                "vertices": (copy.place(prepared.vertices) - origin) / scale,
                "edge_vertices": prepared.edge_vertices + vertices,
                "edge_ranges": prepared.edge_ranges,
                "edge_gaps": gaps * copy.stretch / scale,
                "is_point": prepared.edge_curves < 0,
                "coedge_edges": prepared.coedge_edges + edge_count,
                "coedge_faces": prepared.coedge_faces + copy.first_patch,
                "coedge_loops": prepared.coedge_loops + loops,
                "coedge_reversed": prepared.coedge_reversed,
            }
            for name, values in rows.items():
                columns.setdefault(name, []).append(values)
            own_edges, own_images = definitions[copy.definition]
            edges.append(_place_pieces(copy, own_edges, edge_count, (origin, scale)))
            images.append(_place_pieces(copy, own_images, coedge_count, (origin, scale)))
            vertices += len(prepared.vertices)
            edge_count += len(prepared.edge_vertices)
            coedge_count += count
            first_coedge.append(coedge_count)
            loops += len(prepared.loop_faces)
        joined: dict[str, Any] = {name: np.concatenate(each) for name, each in columns.items()}
        return cls(
            members,
            np.array(first_coedge),
            is_reversed=part.is_reversed,
            edges=_join_pieces(edges),
            images=_join_pieces(images),
            **joined,
        )

    def locate(self, coedge: Ints, t: FloatArray) -> FloatArray:
        """The parameters (m, 2) of faces at parameters t (m,) of coedges (m,)."""
        parameters = np.empty((len(coedge), 2))
        brep = np.searchsorted(self.first_coedge, coedge, side="right") - 1
        for number in np.unique(brep).tolist():
            rows = (brep == number).nonzero()[0]
            prepared = self._find_brep(number)
            own = coedge[rows] - self.first_coedge[number]
            places = prepared.pcurves.evaluate(own, t[rows])
            parameters[rows] = prepared.places.to_parameters(prepared.coedge_faces[own], places)
        return parameters

    def find_inside(self, face: Ints, parameters: FloatArray) -> Ints:
        """Whether parameters (m, 2) of faces (m,) are in their regions (`Regions.find_inside`)."""
        answers = np.full(len(face), OUTSIDE)
        firsts = np.array([copy.first_patch for copy in self.members.copies])
        owner = np.searchsorted(firsts, face, side="right") - 1
        for number in np.unique(owner).tolist():
            rows = (owner == number).nonzero()[0]
            regions, own = self._find_brep(number).regions, face[rows] - firsts[number]
            answers[rows] = regions.find_inside(own, parameters[rows]).inside
        return answers

    def _find_brep(self, copy: int) -> PreparedBrep:
        """The brep of a copy."""
        return self.members.definitions[self.members.copies[copy].definition]


@dataclass(frozen=True, eq=False)
class _Curves:
    """Curves of a brep before its placement: pieces, their curves, and their nets by degree."""

    curve: Ints
    parts: Intervals
    nets: list[tuple[Ints, FloatArray]]


def _list_curves(prepared: PreparedBrep) -> tuple[_Curves, _Curves]:
    """The edges that are curves, and the images of coedges; in model coordinates of the brep."""
    curved = (prepared.edge_curves >= 0).nonzero()[0]
    low, high = prepared.edge_ranges[curved].T
    parts = prepared.curves.cut(prepared.edge_curves[curved], low, high)
    edges = _Curves(curved[parts.source], parts, list(prepared.curves.restrict(parts)))
    images = _compose(prepared)
    spans = images.list_spans()
    return edges, _Curves(spans.curve, spans, list(images.restrict(spans)))


def _compose(prepared: PreparedBrep) -> Splines:
    """The images of all coedges."""
    face, places = prepared.coedge_faces, prepared.places
    scale = places.extent[face] / SIZE
    pcurves = prepared.pcurves.map_points(-places.origin[face] / scale, scale)
    surfaces = ClosedSurfaces.open(prepared.surfaces)
    return compose_curves(surfaces, face, pcurves, GOAL * prepared.diagonal)


def _place_pieces(
    copy: BrepCopy, curves: _Curves, first: int, frame: tuple[FloatArray, float]
) -> CurvePieces:
    """The pieces of curves in the coordinates of a part, where they are numbered from `first`."""
    origin, scale = frame
    groups = []
    for rows, nets in curves.nets:
        weights = nets[..., 3:] if nets.shape[-1] == 4 else np.ones((*nets.shape[:2], 1))
        weights = weights / weights.max(axis=1, keepdims=True)
        points = nets[..., :3] / (nets[..., 3:] if nets.shape[-1] == 4 else 1.0)
        points = weights * ((copy.place(points) - origin) / scale)
        values = np.concatenate([points, weights], axis=2)
        groups.append((rows, np.ascontiguousarray(values.transpose(1, 2, 0))))
    return CurvePieces(curves.curve + first, curves.parts.low, curves.parts.high, tuple(groups))


def _join_pieces(parts: Sequence[CurvePieces]) -> CurvePieces:
    """The pieces of several breps."""
    by_degree: dict[int, list[tuple[Ints, FloatArray]]] = {}
    first = 0
    for part in parts:
        for rows, values in part.groups:
            by_degree.setdefault(len(values), []).append((rows + first, values))
        first += len(part.curve)
    groups = tuple(
        (np.concatenate([rows for rows, _ in each]), np.concatenate([v for _, v in each], axis=2))
        for each in by_degree.values()
    )
    return CurvePieces(
        np.concatenate([part.curve for part in parts]),
        np.concatenate([part.low for part in parts]),
        np.concatenate([part.high for part in parts]),
        groups,
    )
