"""The arcs of sections of faces, cut at the borders of the regions of these.

The arcs are those of whole nets. Each end (`ends`) lies on one of them. An arc is cut at its ends;
the part after an end at which the section enters the region is inside, and the part after one at
which it leaves is outside. All arcs that are joined without an end between them are on the same
side, so that one end decides for them. Where no end does, or ends contradict each other by
rounding, or arcs stop at the border of nets, points of them are tested.

Proof in docs/proofs.md: "Sections of parts".
"""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.row_batches import expand_runs, find_begins
from service.cancellation import checkpoint
from service.engine.clustering import find_components
from service.engine.parts.sections.borders import Borders
from service.engine.parts.sections.clusters import CLUSTER, Clusters
from service.engine.parts.sections.ends import Ends
from service.engine.parts.sections.face_lines import FaceNets
from service.engine.sections.arc_search import ArcNodes
from service.engine.sections.borders import ONE
from service.engine.sections.cells import OVER_U, OVER_V
from service.engine.trims.inside import INSIDE, OUTSIDE
from service.engine.vectors import Items

ROUNDING = 1e-9
"""An end that is this near to the rectangle of an arc, as a share of the face, may be on it."""

NEAR = 2.0**-12
"""An end that is further from all arcs, as a share of the face, is on none."""

NARROW = 2.0**-20
"""On a graph that is narrower than this, as a share of the face, places are found on the chord."""


TESTS = 3
"""This number of points is tested where no end decides."""


@dataclass(frozen=True, eq=False, slots=True)
class FaceArcs(Items):
    """k arcs inside of regions.

    Attributes
    ----------
    nodes : ndarray of int, shape (2, k)
        Nodes of `ArcNodes`, and after these the ends.
    sense : ndarray of float64, shape (k,)
        As in `Arcs`.
    cell : ndarray of int, shape (k,)
        The cell of an arc that was cut and is a graph, else −1.
    face, column : ndarray of int, shape (k,)
    """

    nodes: Ints
    sense: FloatArray
    cell: Ints
    face: Ints
    column: Ints


@dataclass(frozen=True, eq=False)
class ArcsOfFaces:
    """The arcs of whole nets, which are cut at the borders of faces.

    Attributes
    ----------
    faces : FaceNets
    found : ArcNodes
    face : ndarray of int, shape (A,)
        The face of each arc.
    column : ndarray of int, shape (A,)
        The number of the plane of each arc among those of the call.
    parameters : ndarray of float64, shape (N, 2)
        The parameters of the face at each node.
    node_face : ndarray of int, shape (N,)
    """

    faces: FaceNets
    found: ArcNodes
    face: Ints
    column: Ints
    parameters: FloatArray
    node_face: Ints

    @classmethod
    def of(cls, faces: FaceNets, found: ArcNodes, first_plane: int) -> "ArcsOfFaces":
        """The arcs of a search whose nets are those of the faces."""
        segments, arcs = found.segments, found.arcs
        parameters = faces.to_face(segments.node_net, segments.node_parameters)
        node_face = faces.face[segments.node_net]
        face = node_face[arcs.ends[:, 0]]
        column = found.plane[arcs.ends[:, 0]] - first_plane
        return cls(faces, found, face, column, parameters, node_face)

    def cut(
        self, borders: Borders, ends: Ends, is_flat: Bools, extent: FloatArray
    ) -> tuple[FaceArcs, FloatArray]:
        """The arcs inside of the regions of faces, and the parameters (k, 2) of the ends.

        Parameters
        ----------
        is_flat : ndarray of bool, shape (A,)
            Arcs that are left out.
        extent : ndarray of float64, shape (F, 2)
            The lengths of the boxes of regions.
        """
        places = borders.locate(ends.coedge, ends.t)
        arc, share = self._locate(borders, ends, places, is_flat, extent)
        checkpoint()
        return self._split(borders, ends, (arc, share), is_flat, (places, extent)), places

    def _locate(
        self, borders: Borders, ends: Ends, places: FloatArray, is_flat: Bools, extent: FloatArray
    ) -> tuple[Ints, FloatArray]:
        """The arc of each end, −1 if it is on none; and where on the arc, from 0 to 1."""
        face = borders.coedge_faces[ends.coedge]
        faces = len(borders.is_reversed)
        key = self.column * faces + self.face
        order = key.argsort(kind="stable")
        order = order[~is_flat[order]]
        wanted = ends.column * faces + face
        first = np.searchsorted(key[order], wanted)
        last = np.searchsorted(key[order], wanted, side="right")
        end, place = expand_runs(last - first, first)
        arc = order[place]
        cost, share, distance = self._measure(arc, places[end], extent[face[end]])
        cost = np.where(cost <= ROUNDING, 0.0, cost)
        best = np.lexsort((distance, cost, end))
        best = best[find_begins(end[best])]
        best = best[cost[best] <= NEAR]
        found, shares = np.full(len(ends), -1), np.zeros(len(ends))
        found[end[best]], shares[end[best]] = arc[best], share[best]
        return found, shares

    def _measure(
        self, arc: Ints, place: FloatArray, extent: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """How far places (m, 2) are from where arcs (m,) may be; the shares of arcs; distances.

        Lengths are shares of `extent` (m, 2). The last result is the distance to the chord.
        """
        arcs, cells = self.found.arcs, self.found.cells
        begin, end = (self.parameters[arcs.ends[arc, k]] for k in range(2))
        chord = (end - begin) / extent
        offset = (place - begin) / extent
        square = (chord * chord).sum(axis=1)
        share = (offset * chord).sum(axis=1) / np.where(square > 0, square, 1.0)
        share = np.clip(share, 0.0, 1.0)
        cost = np.sqrt(((offset - share[:, np.newaxis] * chord) ** 2).sum(axis=1))
        cell = arcs.cell[arc]
        kind = np.where(cell >= 0, cells.kind[cell], -1)
        graph = ((kind == OVER_U) | (kind == OVER_V)).nonzero()[0]
        if len(graph):
            own, axis = cell[graph], kind[graph]  # the kinds OVER_U and OVER_V are 0 and 1
            rows = np.arange(len(graph))
            low, high = (
                self.faces.to_face(cells.net[own], cells.rectangle[k::2, own] / ONE)
                for k in range(2)
            )
            point = place[graph]
            outside = np.maximum(np.maximum(low - point, point - high), 0.0)
            a, b = begin[graph][rows, axis], end[graph][rows, axis]
            x = point[rows, axis]
            beyond = np.maximum(np.minimum(a, b) - x, x - np.maximum(a, b))
            outside[rows, axis] = np.maximum(outside[rows, axis], beyond)
            cost[graph] = (outside / extent[graph]).max(axis=1)
            is_wide = np.abs(b - a) > NARROW * extent[graph][rows, axis]
            along = np.clip((x - a) / np.where(is_wide, b - a, 1.0), 0.0, 1.0)
            share[graph] = np.where(is_wide, along, share[graph])
        away = offset - share[:, np.newaxis] * chord
        return cost, share, np.sqrt((away * away).sum(axis=1))

    def _split(
        self,
        borders: Borders,
        ends: Ends,
        located: tuple[Ints, FloatArray],
        is_flat: Bools,
        measures: tuple[FloatArray, FloatArray],
    ) -> FaceArcs:
        """The parts of arcs that are inside.

        Parameters
        ----------
        located : (ndarray of int (k,), ndarray of float64 (k,))
            The arc of each end, and its share of the arc.
        measures : (ndarray of float64 (k, 2), ndarray of float64 (F, 2))
            The parameters of the ends, and the lengths of the boxes of regions.
        """
        (arc, share), (places, extent) = located, measures
        arcs, count = self.found.arcs, len(self.parameters)
        if not len(arcs.ends):
            none = np.zeros(0, np.intp)
            return FaceArcs(np.zeros((2, 0), np.intp), np.zeros(0), none, none, none)
        chord = self.parameters[arcs.ends[:, 1]] - self.parameters[arcs.ends[:, 0]]
        lengths = np.sqrt(((chord / extent[self.face]) ** 2).sum(axis=1))
        self._move_to_nodes(arc, share, lengths, is_flat)
        # Along an arc with the positive side on its right, sections leave where they seem to enter.
        enters = ends.enters ^ (arcs.sense[arc] < 0)
        clusters = Clusters.of(arc, share, enters, lengths)
        whole = (~is_flat).nonzero()[0]
        cuts = np.bincount(clusters.arc, minlength=len(self.face))[whole]
        row, number = expand_runs(cuts + 1)
        source = whole[row]
        first = np.searchsorted(clusters.arc, source)
        has_before, has_after = number > 0, number < cuts[row]
        before = np.where(has_before, first + number - 1, -1)
        after = np.where(has_after, first + number, -1)
        net = np.append(clusters.net, 0)
        known = arcs.sense[source] != 0
        vote = np.where(known, np.sign(net[before]) - np.sign(net[after]), 0)
        nodes = np.where(np.stack([has_before, has_after], axis=1), -1, arcs.ends[source])
        # The parts before and after ends that cancel each other are on one side.
        joined = (has_before & (net[before] == 0)).nonzero()[0]
        is_kept = self._decide(borders, (nodes, vote, joined), source, (places, clusters, before))
        ordered = clusters.order_ends(is_kept, before)
        begin, end = clusters.first[after], clusters.last[before]
        nodes[has_after, 1] = count + ordered[begin[has_after]]
        nodes[has_before, 0] = count + ordered[end[has_before]]
        one, two = clusters.list_inner(ordered, enters)
        inner = np.stack([count + one, count + two], axis=1)
        nodes = np.concatenate([nodes[is_kept], inner])
        is_cut = np.concatenate([(cuts[row] > 0)[is_kept], np.ones(len(one), bool)])
        source = np.concatenate([source[is_kept], arc[one]])
        cell = np.where(is_cut, arcs.cell[source], -1)
        kind = np.where(cell >= 0, self.found.cells.kind[cell], -1)
        cell[(kind != OVER_U) & (kind != OVER_V)] = -1
        return FaceArcs(nodes.T, arcs.sense[source], cell, self.face[source], self.column[source])

    def _move_to_nodes(
        self, arc: Ints, share: FloatArray, lengths: FloatArray, is_flat: Bools
    ) -> None:
        """Move ends that are near a node to this node, on one arc for all ends that are there."""
        arcs, count = self.found.arcs, len(self.parameters)
        first = np.full(count, len(arcs.ends))
        whole = (~is_flat).nonzero()[0]
        np.minimum.at(first, arcs.ends[whole].ravel(), whole.repeat(2))
        away = np.where(arc >= 0, lengths[arc], 1.0)
        at_end = (1 - share) * away <= CLUSTER
        rows = (((share * away <= CLUSTER) | at_end) & (arc >= 0)).nonzero()[0]
        node = arcs.ends[arc[rows], (share[rows] > 0.5).astype(np.intp)]
        arc[rows] = first[node]
        share[rows] = np.where(arcs.ends[first[node], 0] == node, 0.0, 1.0)

    def _decide(
        self,
        borders: Borders,
        parts: tuple[Ints, Ints, Ints],
        source: Ints,
        ends: tuple[FloatArray, "Clusters", Ints],
    ) -> Bools:
        """Which parts of arcs are inside.

        Parameters
        ----------
        parts : (ndarray of int (m, 2), ndarray of int (m,), ndarray of int (j,))
            The nodes of each part, −1 where it ends at an end of a section; votes above 0 where
            ends say that a part is inside, below 0 if not; and parts that are on the side of the
            part before them.
        """
        nodes, vote, joined = parts
        count, total = len(self.parameters), len(self.parameters) + len(nodes)
        # Parts are joined by nodes, but not by ends.
        part = np.arange(len(nodes)) + count
        one, two = ((nodes[:, k] >= 0).nonzero()[0] for k in range(2))
        label = find_components(
            total,
            np.concatenate([part[one], part[two], part[joined]]),
            np.concatenate([nodes[one, 0], nodes[two, 1], part[joined - 1]]),
        )[count:]
        ayes = np.bincount(label[vote > 0], minlength=total)
        noes = np.bincount(label[vote < 0], minlength=total)
        degree = np.bincount(nodes[nodes >= 0], minlength=count)
        is_odd = (degree[nodes] % 2 == 1) & (nodes >= 0)
        stops = np.bincount(label[is_odd.any(axis=1)], minlength=total) > 0
        is_inside = (ayes > 0) & (noes == 0)
        is_open = ((ayes > 0) == (noes > 0)) | (stops & (ayes > 0))
        rows = is_open[label].nonzero()[0]
        if len(rows):
            places, clusters, before = ends
            everywhere = np.concatenate([self.parameters, places])
            # The last end before a part, and the first after it, where it has no node.
            after = np.where(before >= 0, before + 1, np.searchsorted(clusters.arc, source))
            limits = np.stack([clusters.last[before], clusters.first[after % len(clusters.first)]])
            points = np.where(nodes[rows] >= 0, nodes[rows], count + clusters.end[limits.T[rows]])
            # The middles of chords are near the section, and nodes are on it; but nodes at which
            # arcs stop are on the border of a net.
            has_node = (nodes[rows, 1] >= 0) & ~is_odd[rows, 1]
            middle = (everywhere[points[:, 0]] + everywhere[points[:, 1]]) / 2
            tests = np.where(has_node[:, np.newaxis], everywhere[points[:, 1]], middle)
            is_inside[label[rows]] = self._test(
                borders, tests, label[rows], self.face[source[rows]]
            )
        result: Bools = is_inside[label]
        return result

    def _test(self, borders: Borders, points: FloatArray, label: Ints, face: Ints) -> Bools:
        """Whether joined parts (m,) of arcs are inside, by points of them.

        A point that is outside decides; otherwise one must be inside for certain. `points` (m, 2)
        are parameters of faces (m,).
        """
        order = label.argsort(kind="stable")
        begin = find_begins(label[order])
        size = np.diff(np.append(begin, len(order)))
        tests = np.minimum(size, TESTS)
        run, number = expand_runs(tests)
        chosen = order[begin[run] + (2 * number + 1) * size[run] // (2 * tests[run])]
        answers = borders.find_inside(face[chosen], points[chosen])
        outside = np.bincount(run[answers == OUTSIDE], minlength=len(begin))
        inside = np.bincount(run[answers == INSIDE], minlength=len(begin))
        result = np.empty(len(label), bool)
        result[order] = np.repeat((outside == 0) & (inside > 0), size)
        return result
