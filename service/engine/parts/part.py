"""A whole part, ready for questions: the nets of a brep, or of a group with breps.

Proof in docs/proofs.md: "Nets of a part".
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.engine.nets.query_nets import QueryNets
from service.engine.parts.copies import Members
from service.engine.parts.edge_nets import EdgeRows
from service.engine.parts.edge_uses import EdgeUses
from service.engine.parts.placed_nets import NetRows
from service.engine.trims.trimmed_nets import NetTrims
from service.engine.vectors import project
from service.surface.brep_model import SkippedFace
from service.surface.placement import Box, is_mirroring, join_boxes


@dataclass(frozen=True, eq=False)
class Part:
    """A part: the trimmed regions of all faces on their surfaces, its edges, and whole patches.

    Attributes
    ----------
    nets : QueryNets
        First the nets of faces and of patches without trims, then those of edges, of degree (n, 0).
        `patch` has numbers of the request, `corners` parameters of the patches `rows.span`.
    trims : NetTrims
    rows : NetRows
        The faces and patches of the nets.
    surface_nets : int
        How many nets come before those of edges.
    edges : EdgeRows
        The edges of nets: row k is that of net `surface_nets` + k. Edges, coedges and faces
        are counted over all breps, each brep once, whatever its copies; gaps are in the
        coordinates of the nets, and errors of the nets are not in them.
    members : Members
    speeds : tuple of ndarray of float64, shape (F,) each
        For each brep, bounds of how far points of its faces move for one unit of places along both
        axes; model units.
    """

    nets: QueryNets
    trims: NetTrims
    rows: NetRows
    surface_nets: int
    edges: EdgeRows
    members: Members
    speeds: tuple[FloatArray, ...]

    @cached_property
    def faces(self) -> QueryNets:
        """The nets of faces and patches alone, with the same numbers."""
        return self._choose_nets(slice(self.surface_nets))

    @cached_property
    def curves(self) -> QueryNets | None:
        """The nets of edges alone, numbered from 0; None if there are none."""
        if self.surface_nets == len(self.nets.patch):
            return None
        return self._choose_nets(slice(self.surface_nets, None))

    @cached_property
    def bounds(self) -> Box:
        """Least and greatest coordinates of the control points of all nets; model units."""
        boxes = list[Box]()
        for group in self.nets.groups:
            points = project(group.values)
            axes = (0, 1, 3)
            boxes.append((points.min(axis=axes), points.max(axis=axes)))
        origin, scale = self.nets.origin, self.nets.scale
        if not boxes:  # all faces are skipped
            return origin, origin
        low, high = join_boxes(boxes)
        return origin + low * scale, origin + high * scale

    @property
    def diagonal(self) -> float:
        """The diagonal of the box of all members; model units."""
        return self.nets.diagonal

    @cached_property
    def is_reversed(self) -> Bools:
        """Whether the normal of a face or patch, (P,), is −(du × dv) after its placement."""
        is_reversed = np.zeros(self.members.patch_count, bool)
        for copy in self.members.copies:
            own = self.members.definitions[copy.definition].is_reversed
            faces = slice(copy.first_patch, copy.first_patch + len(own))
            is_reversed[faces] = own != is_mirroring(copy.matrix)
        return is_reversed

    @cached_property
    def solids(self) -> Ints:
        """The copy of a brep of which each face or patch (P,) is, if it is closed; or −1."""
        solids = np.full(self.members.patch_count, -1)
        for number, copy in enumerate(self.members.copies):
            prepared = self.members.definitions[copy.definition]
            if EdgeUses.of(prepared).is_closed:
                faces = slice(copy.first_patch, copy.first_patch + len(prepared.surfaces))
                solids[faces] = number
        return solids

    @cached_property
    def skipped_faces(self) -> tuple[SkippedFace, ...]:
        """The faces that take no part, by their numbers in the request; once for each brep."""
        return tuple(self.members.list_skipped())

    def _choose_nets(self, nets: slice) -> QueryNets:
        """The nets of a run of groups alone."""
        first = nets.start or 0
        last = len(self.nets.patch) if nets.stop is None else nets.stop
        groups = tuple(
            replace(group, first=group.first - first)
            for group in self.nets.groups
            if first <= group.first < last
        )
        errors = self.nets.errors
        return replace(
            self.nets,
            groups=groups,
            patch=self.nets.patch[nets],
            corners=self.nets.corners[nets],
            errors=None if errors is None else errors[nets],
        )
