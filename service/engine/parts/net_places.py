"""Where the images of edges are in the nets of the faces of a part."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.engine.parts.part import Part


@dataclass(frozen=True, eq=False)
class NetPlaces:
    """The nets of faces, found by parameters of surfaces.

    Attributes
    ----------
    part : Part
    """

    part: Part

    def find(self, copy: Ints, coedge: Ints, t: FloatArray) -> tuple[Ints, FloatArray]:
        """Nets (m,) and their parameters (2, m) of coedges of copies (m,) at t of their edges."""
        trims = self.part.trims
        regions = trims.regions
        face = self._coedge_faces[coedge]
        uv = regions.places.to_parameters(face, regions.tree.pcurves.evaluate(coedge, t))
        net = self._find_nets(copy, face, uv)
        low, high = trims.low[net], trims.high[net]
        side = np.where(high > low, high - low, 1.0)
        return net, np.ascontiguousarray(np.clip((uv - low) / side, 0.0, 1.0).T)

    def _find_nets(self, copy: Ints, face: Ints, uv: FloatArray) -> Ints:
        """The nets (m,) of faces of copies that contain parameters (m, 2), or nearly do."""
        net = np.full(len(face), -1)
        for before_u, before_v in ((False, False), (True, False), (False, True), (True, True)):
            rows = np.flatnonzero(net < 0)
            if not len(rows):
                break
            key = self._make_keys(copy[rows], face[rows], uv[rows], (before_u, before_v))
            at = np.minimum(np.searchsorted(self._keys, key), len(self._keys) - 1)
            found = self._keys[at] == key
            net[rows[found]] = self._order[at[found]]
        rows = np.flatnonzero(net < 0)
        # Beyond all nets of the face: the first one.
        net[rows] = self._first_nets[copy[rows], face[rows]]
        return net

    def _make_keys(self, copy: Ints, face: Ints, uv: FloatArray, before: tuple[bool, bool]) -> Ints:
        """The keys (m,) of the spans with parameters (m, 2), or of those that end there."""
        span = np.zeros(len(face), np.intp)
        for number, definition in enumerate(self.part.members.definitions):
            first = self._first_faces[number]
            rows = np.flatnonzero((face >= first) & (face < first + len(definition.surfaces)))
            surfaces, own = definition.surfaces, face[rows] - first
            u, v = (
                surfaces.breaks.find_spans(2 * own + axis, uv[rows, axis], before=before[axis])
                for axis in range(2)
            )
            span[rows] = surfaces.faces.first[own] + u * surfaces.faces.stride[own] + v
        return copy * self._step + span

    @cached_property
    def _step(self) -> int:
        return int(self.part.rows.span.max(initial=0)) + 1

    @cached_property
    def _nets(self) -> Ints:
        """The nets of faces."""
        return np.flatnonzero(self.part.trims.face >= 0)

    @cached_property
    def _order(self) -> Ints:
        rows, nets = self.part.rows, self._nets
        return nets[np.lexsort((rows.span[nets], rows.copy[nets]))]

    @cached_property
    def _keys(self) -> Ints:
        rows, nets = self.part.rows, self._order
        keys: Ints = rows.copy[nets] * self._step + rows.span[nets]
        return keys

    @cached_property
    def _first_nets(self) -> Ints:
        """The first net of each face of all breps in each copy, (copies, faces)."""
        trims, rows, nets = self.part.trims, self.part.rows, self._nets[::-1]
        first = np.zeros((len(self.part.members.copies), len(trims.regions.margins)), np.intp)
        first[rows.copy[nets], trims.face[nets]] = nets
        return first

    @cached_property
    def _first_faces(self) -> list[int]:
        """The first face of each brep."""
        counts = [len(each.surfaces) for each in self.part.members.definitions]
        return [0, *np.cumsum(counts).tolist()]

    @cached_property
    def _coedge_faces(self) -> Ints:
        """The face of each coedge of all breps."""
        return np.concatenate(
            [
                each.coedge_faces + first
                for each, first in zip(
                    self.part.members.definitions, self._first_faces, strict=False
                )
            ]
        )
