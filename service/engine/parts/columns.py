"""Columns of responses for points on parts: parameters and normals of faces and patches."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.engine.evaluation.normals import evaluate_scattered_normals
from service.engine.parts.part import Part
from service.engine.points.surface_columns import MIN_SINE, Columns, surface_columns
from service.engine.scenes.placing import place_normals
from service.engine.vectors import cross, dot, length

NEAR_END = 2.0**-40
"""Parameters that are beyond the domain of a plane by at most this share of it are at its end."""


@dataclass(frozen=True, eq=False)
class PartColumns:
    """Makes columns of points on a part."""

    part: Part

    def describe(
        self, net: Ints, parameters: FloatArray, du: FloatArray, dv: FloatArray
    ) -> Columns:
        """The arrays `uv`, `patch` and `normals` of points on nets of faces and patches.

        Normals are those of faces, so that they point out of the material of solids.

        Parameters
        ----------
        net : ndarray of int, shape (m,)
        parameters : ndarray of float64, shape (2, m)
            Of the nets.
        du, dv : ndarray of float64, shape (3, m)
            Partials of the nets there.
        """
        rows = self.part.rows
        columns: Columns = {
            "uv": np.empty((len(net), 2)),
            "patch": self.part.nets.patch[net],
            "normals": np.empty((len(net), 3)),
        }
        local = self.part.nets.parameters(net, parameters.T)
        whole = np.flatnonzero(rows.copy[net] < 0)
        if len(whole) and self.part.members.patches is not None:
            span, model = rows.span[net[whole]], self.part.members.patches
            found = surface_columns(model, span, local[whole], du[:, whole], dv[:, whole])
            columns["uv"][whole], columns["normals"][whole] = found["uv"], found["normals"]
        trimmed = np.flatnonzero(rows.copy[net] >= 0)
        own = net[trimmed]
        uv = self.part.trims.to_face(own, parameters[:, trimmed])
        columns["uv"][trimmed] = self.wrap(rows.face[own], uv)
        partials = du[:, trimmed], dv[:, trimmed]
        place = rows.span[own], local[trimmed]
        columns["normals"][trimmed] = self.find_normals(
            rows.copy[own], rows.patch[own], place, *partials
        )
        return columns

    def describe_edges(self, edge: Ints, share: FloatArray) -> Columns:
        """The arrays of `describe` for points on edges, on the face with the lowest number there.

        `edge` (m,) are rows of `Part.edges`, and `share` (m,) parameters of their nets.
        """
        part = self.part
        edges = part.edges.take(edge)
        copy = part.rows.copy[part.surface_nets + edge]
        t = edges.low + share * (edges.high - edges.low)
        places = part.trims.regions.tree.pcurves.evaluate(edges.coedge, t)
        uv = part.trims.regions.places.to_parameters(edges.face, places)
        du, dv, local = np.empty((3, len(edge))), np.empty((3, len(edge))), uv.copy()
        span = np.empty(len(edge), np.intp)
        for number in np.unique(copy).tolist():
            mine = np.flatnonzero(copy == number)
            of_copy = part.members.copies[number]
            surfaces = part.members.definitions[of_copy.definition].surfaces
            face = edges.face[mine] - of_copy.first_face
            span[mine], spans, widths = surfaces.locate(face, uv[mine])
            local[mine] = spans.T
            partials = surfaces.evaluate_partials(face, uv[mine]).transpose(0, 2, 1)
            linear = np.eye(3) if of_copy.matrix is None else of_copy.matrix[:3, :3]
            widths = widths / part.nets.scale
            du[:, mine], dv[:, mine] = (linear @ partials[k + 1] * widths[k] for k in range(2))
        patch = part.nets.patch[part.surface_nets + edge]
        return {
            "uv": self.wrap(edges.face, uv),
            "patch": patch,
            "normals": self.find_normals(copy, patch, (span, local), du, dv),
        }

    def find_normals(
        self,
        copy: Ints,
        patch: Ints,
        place: tuple[Ints, FloatArray],
        du: FloatArray,
        dv: FloatArray,
    ) -> FloatArray:
        """The normals (m, 3) of faces of copies (m,), which are the patches (m,) of the request.

        `place` are the patches of the surfaces, (m,), and parameters (m, 2) there; `du` and `dv`
        (3, m) are partials after the placement, in the coordinates of nets. Normals that these do
        not give precisely are limits.
        """
        with np.errstate(all="ignore"):
            products = cross(du, dv)
            lengths = length(products)
            normals = np.ascontiguousarray((products / lengths).T)
            along = np.sqrt([dot(du, du), dot(dv, dv)])
            is_precise = lengths > MIN_SINE * along.prod(axis=0)
            is_precise &= along.min(axis=0) > MIN_SINE**2
        normals[self.part.is_reversed[patch]] *= -1.0
        span, (u, v) = place[0], place[1].T
        rows = np.flatnonzero(~is_precise)
        for number in np.unique(copy[rows]).tolist():
            mine = rows[copy[rows] == number]
            of_copy = self.part.members.copies[number]
            prepared = self.part.members.definitions[of_copy.definition]
            batches = prepared.surfaces.model.batches
            limits, _ = evaluate_scattered_normals(batches, span[mine], u[mine], v[mine])
            is_reversed = prepared.is_reversed[patch[mine] - of_copy.first_patch]
            limits[is_reversed] *= -1.0
            normals[mine] = place_normals(limits, of_copy.matrix)
        return normals + 0.0  # −0 becomes 0

    def wrap(self, face: Ints, uv: FloatArray) -> FloatArray:
        """Parameters (m, 2) in the domains that the surfaces of faces (m,) have in the request."""
        low, high, period, is_free = (values[face] for values in self._domains)
        turns = np.floor((uv - low) / np.where(period > 0, period, 1.0))
        is_beyond = (period > 0) & ((uv < low) | (uv > high))
        uv = np.where(is_beyond, uv - turns * period, uv)
        reach = np.where(is_free[:, np.newaxis], NEAR_END * (high - low), np.inf)
        uv = np.where((uv < low) & (uv >= low - reach), low, uv)
        result: FloatArray = np.where((uv > high) & (uv <= high + reach), high, uv) + 0.0
        return result

    @cached_property
    def _domains(self) -> tuple[FloatArray, FloatArray, FloatArray, Bools]:
        """For each face: the least and the greatest parameters, and the periods, (F, 2) each.

        The last array is whether it is a plane, which has no ends.
        """
        definitions = self.part.members.definitions
        tables = [each.model.surfaces for each in definitions]
        domains = np.concatenate([table.domains for table in tables])
        return (
            domains[:, :, 0],
            domains[:, :, 1],
            self.part.trims.regions.periods,
            np.concatenate([each.surfaces.is_planar for each in definitions]),
        )
