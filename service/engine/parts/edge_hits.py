"""Hits of rays that pass edges: for each pass, one for each face at the edge."""

from dataclasses import dataclass

import numpy as np

from service.bases.row_batches import expand_runs
from service.engine.nets.partials import net_partials
from service.engine.nets.query_nets import QueryNets
from service.engine.parts.border_nets import BorderNets
from service.engine.parts.net_places import NetPlaces
from service.engine.rays.edge_search import EdgePasses
from service.engine.rays.hits import MIN_LENGTH_ALONG, NO_HITS, Evidence, Hits


@dataclass(frozen=True, eq=False)
class EdgeFaces:
    """The faces at edges and vertices.

    Attributes
    ----------
    borders : BorderNets
    faces : QueryNets
        The nets of faces.
    places : NetPlaces
    thickness : float
        Of rays, in the coordinates of the nets.
    """

    borders: BorderNets
    faces: QueryNets
    places: NetPlaces
    thickness: float

    def list_hits(self, passes: EdgePasses) -> Hits:
        """For each pass one hit for each face at the edge, on a net of this face.

        Hits have the position of the edge and the partials of the face. Their label is `SEAM` at
        seams and poles, else `EDGE`, or `LONG_EDGE` where the ray follows the edge.
        """
        first = self.borders.first_side[passes.net]
        row, side = expand_runs(self.borders.first_side[passes.net + 1] - first, first)
        if not len(row):
            return NO_HITS
        sides, share = self.borders.sides.take(side), passes.parameter[row]
        t = sides.low + share * (sides.high - sides.low)
        net, parameters = self.places.find(sides.copy, sides.coedge, t)
        _, du, dv = net_partials(self.faces, net, parameters, 1)
        chosen = passes.take(row)
        reach = self.borders.reach[passes.net[row]] + self.thickness
        diagonal = self.faces.diagonal / self.faces.scale
        is_long = chosen.high - chosen.low > MIN_LENGTH_ALONG * np.sqrt(reach * diagonal)
        label = np.where(is_long, Evidence.LONG_EDGE, Evidence.EDGE)
        is_border = self.borders.is_border[passes.net[row]]
        label = np.where(is_border, label, Evidence.SEAM).astype(np.intp)
        is_near_edge = np.ones(len(row), bool)
        point = chosen.ray, net, parameters, chosen.position, du, dv
        ends = chosen.t, chosen.distance, chosen.low, chosen.high
        return Hits(*point, *ends, label, np.zeros(len(row)), is_near_edge)
