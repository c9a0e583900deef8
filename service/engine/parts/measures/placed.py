"""A placed copy of a brep in the coordinates in which it is measured."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from service.bases.arrays import FloatArray
from service.bases.row_batches import expand_runs
from service.engine.brep.prepared import PreparedBrep
from service.engine.measures.box_nets import MeasuredPatches
from service.engine.nets.query_nets import frame
from service.engine.parts.placed_nets import Frame, place_nets
from service.engine.scenes.placing import scalings
from service.surface.placement import is_mirroring, place_box


@dataclass(frozen=True, eq=False)
class PlacedBrep:
    """A placed copy of a brep.

    Attributes
    ----------
    prepared : PreparedBrep
    matrix : ndarray of float64, shape (4, 4), or None
    """

    prepared: PreparedBrep
    matrix: FloatArray | None = None

    @cached_property
    def frame(self) -> Frame:
        """The frame of the nets: the middle of the box, and a power of two above its size."""
        low, high = self.prepared.box
        origin, scale, _ = frame(*place_box((low, high), self.matrix))
        return Frame(origin, scale)

    @cached_property
    def radius(self) -> float:
        """A bound of the distances of points of edges from the origin, in the frame."""
        low, high = place_box(tuple(self.prepared.box), self.matrix)
        return float(np.linalg.norm((high - low) / self.frame.scale))

    @property
    def stretch(self) -> float:
        """A bound of how much longer lengths of the model are in the frame."""
        return scalings(self.matrix)[1] / self.frame.scale

    @cached_property
    def shift(self) -> float:
        """A bound of the coordinates that placing adds to points, in the frame."""
        moved = 0.0 if self.matrix is None else float(np.abs(self.matrix[:3, 3]).max())
        return (moved + float(np.abs(self.frame.origin).max())) / self.frame.scale

    @cached_property
    def sides(self) -> FloatArray:
        """1 or −1 for each face, (F,): −1 where its normal is −(du × dv) after placing."""
        is_opposite = self.prepared.is_reversed != is_mirroring(self.matrix)
        return np.where(is_opposite, -1.0, 1.0)

    def to_local(self, points: FloatArray) -> FloatArray:
        """Points (…, 3) of the model in the frame."""
        if self.matrix is not None:
            points = points @ self.matrix[:3, :3].T + self.matrix[:3, 3]
        return np.asarray((points - self.frame.origin) / self.frame.scale)

    @cached_property
    def patches(self) -> tuple[MeasuredPatches, ...]:
        """The patches of each group of the surfaces' nets."""
        surfaces = self.prepared.surfaces
        nets = surfaces.nets
        face, number = expand_runs(surfaces.faces.spans.prod(axis=0))
        errors = np.empty(len(nets.row))
        errors[surfaces.faces.first[face] + number] = surfaces.errors[face]
        result = []
        for group in nets.groups:
            values, distances = place_nets(
                group.items,
                nets.middles[:, group.patches],
                nets.sizes[group.patches],
                errors[group.patches],
                matrix=self.matrix,
                frame=self.frame,
            )
            items = np.ascontiguousarray(values.transpose(3, 2, 0, 1))
            result.append(MeasuredPatches.of(items, distances))
        return tuple(result)
