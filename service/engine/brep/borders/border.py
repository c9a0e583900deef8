"""The borders of all faces: loops as polygons of places, each side the image of a piece of an edge.

A *place* is a pair of whole numbers from 0 to 2^30 over the box of the parameter curves of a face.
"""

from dataclasses import dataclass, replace

import numpy as np

from service.bases.arrays import FloatArray, Ints
from service.bases.row_batches import expand_runs, find_begins, unique_values
from service.engine.brep.borders.edges import EdgeSamples
from service.engine.brep.prepared import PreparedBrep
from service.engine.trims.places import BITS, SIZE
from service.surface.spline_tables import find_starts


@dataclass(frozen=True, eq=False, slots=True)
class Polygons:
    """Closed polygons of places with M sides in all, in the order of faces and loops.

    Side i runs from place `begins[i]` to place `ends[i]`, with the material on its left; `ends[i]`
    is `begins[nexts[i]]`. In the mesh it runs from vertex `begin_vertices[i]` to vertex
    `end_vertices[i]`. They are equal in poles and in collapsed edges.

    Attributes
    ----------
    faces : ndarray of int, shape (M,)
        In ascending order.
    loops : ndarray of int, shape (M,)
        In ascending order.
    nexts : ndarray of int, shape (M,)
        The next side of the loop.
    begins, ends : ndarray of int, shape (M, 2)
        Places.
    begin_vertices, end_vertices : ndarray of int, shape (M,)
        Vertices of the mesh.
    """

    faces: Ints
    loops: Ints
    nexts: Ints
    begins: Ints
    ends: Ints
    begin_vertices: Ints
    end_vertices: Ints

    def number_places(self) -> Ints:
        """Numbers (M,) of the places at which sides begin; those of each face are its own."""
        codes = unique_values(self.begins[:, 0] << (BITS + 1) | self.begins[:, 1])[1]
        return unique_values(codes << 32 | self.faces)[1]


@dataclass(frozen=True, eq=False, slots=True)
class Border(Polygons):
    """The polygons of all loops: each side is the image of a piece of an edge, in its chord.

    Two sides with one `samples[i]` are the two images of one piece of an edge.

    Attributes
    ----------
    coedges : ndarray of int, shape (M,)
        In ascending order.
    samples : ndarray of int, shape (M,)
        The piece of the edge (the sample at which it begins, in the direction of the edge).
    segment_bounds : ndarray of float64, shape (M,)
        No point of the surface over the segment of places is further from the chord than this; NaN
        if it was not measured yet.
    sliver_bounds : ndarray of float64, shape (M,)
        The surface over the part of the trimmed region that is beyond the segment, outside of the
        polygon, is no further from the chord than this; NaN if it was not measured yet.
    rows : ndarray of int, shape (M,)
        The row of `places` at which each side begins.
    places : ndarray of float64, shape (C, 2)
        The places of all samples of all coedges before they are rounded and joined, coedge after
        coedge, each in the direction of its edge.
    shifts : ndarray of int, shape (C, 2)
        Units by which rounded places were moved, to keep loops apart: −1, 0 or 1.
    offsets : ndarray of int, shape (coedges + 1,)
        The rows of `places` of coedge c are those from `offsets[c]` to `offsets[c + 1] - 1`.
    """

    coedges: Ints
    samples: Ints
    segment_bounds: FloatArray
    sliver_bounds: FloatArray
    rows: Ints
    places: FloatArray
    shifts: Ints
    offsets: Ints


def build_border(prepared: PreparedBrep, samples: EdgeSamples) -> Border:
    """The polygons of all loops, with sides that were not measured yet."""
    counts = samples.counts[prepared.coedge_edges]
    coedge, sample = expand_runs(counts, samples.offsets[prepared.coedge_edges])
    places = prepared.pcurves.evaluate(coedge, samples.parameters[sample])
    shifts = np.zeros((len(coedge), 2), np.intp)
    return _join_coedges(prepared, samples, places, shifts)


def renew_border(
    prepared: PreparedBrep, samples: EdgeSamples, border: Border, source: Ints
) -> Border:
    """The border after samples were inserted; sides that did not change keep their bounds.

    Parameters
    ----------
    samples : EdgeSamples
        The new samples.
    border : Border
        That of the old ones.
    source : ndarray of int, shape (T,)
        The old number of each sample; −1 for new samples.
    """
    edges, old_offsets = prepared.coedge_edges, _find_old_offsets(samples, source)
    coedge, sample = expand_runs(samples.counts[edges], samples.offsets[edges])
    old = source[sample]
    row = border.offsets[coedge] + old - old_offsets[edges[coedge]]
    kept, new = (old >= 0).nonzero()[0], (old < 0).nonzero()[0]
    places, shifts = np.empty((len(coedge), 2)), np.zeros((len(coedge), 2), np.intp)
    places[kept], shifts[kept] = border.places[row[kept]], border.shifts[row[kept]]
    places[new] = prepared.pcurves.evaluate(coedge[new], samples.parameters[sample[new]])
    renewed = _join_coedges(prepared, samples, places, shifts)
    begin, end = source[renewed.samples], source[renewed.samples + 1]
    same = ((begin >= 0) & (end == begin + 1)).nonzero()[0]
    owner = renewed.coedges[same]
    number = begin[same] - old_offsets[edges[owner]]
    count = border.offsets[owner + 1] - border.offsets[owner] - 1
    number = np.where(prepared.coedge_reversed[owner], count - 1 - number, number)
    # A coedge of n samples has n − 1 sides.
    side = border.offsets[owner] - owner + number
    renewed.segment_bounds[same] = border.segment_bounds[side]
    renewed.sliver_bounds[same] = border.sliver_bounds[side]
    return renewed


def _find_old_offsets(samples: EdgeSamples, source: Ints) -> Ints:
    """The old offsets (E + 1,) of samples: no sample is inserted before the first of an edge."""
    return find_starts(np.bincount(samples.edges[source >= 0], minlength=len(samples.is_point)))


def _join_coedges(
    prepared: PreparedBrep, samples: EdgeSamples, places: FloatArray, shifts: Ints
) -> Border:
    """Sides between the samples of coedges, in the direction of loops."""
    counts = samples.counts[prepared.coedge_edges]
    offsets = find_starts(counts)
    coedge, number = expand_runs(counts - 1)
    is_reversed = prepared.coedge_reversed[coedge]
    number = np.where(is_reversed, counts[coedge] - 1 - number, number)
    row = offsets[coedge] + number
    sample = samples.offsets[prepared.coedge_edges[coedge]] + number
    loops = prepared.coedge_loops[coedge]
    nexts = np.arange(1, len(coedge) + 1)
    starts = find_begins(loops)
    nexts[np.append(starts[1:], len(coedge))[: len(starts)] - 1] = starts
    begins = np.rint(places.take(row, axis=0)).astype(np.intp) + shifts.take(row, axis=0)
    begins = np.minimum(np.maximum(begins, 0), SIZE)
    vertices = samples.vertices[sample]
    unknown = np.full((2, len(coedge)), np.nan)
    return Border(
        faces=prepared.coedge_faces[coedge],
        loops=loops,
        nexts=nexts,
        begins=begins,
        ends=begins.take(nexts, axis=0),
        begin_vertices=vertices,
        end_vertices=vertices[nexts],
        coedges=coedge,
        samples=sample - is_reversed,
        segment_bounds=unknown[0],
        sliver_bounds=unknown[1],
        rows=row,
        places=places,
        shifts=shifts,
        offsets=offsets,
    )


def shift_corners(border: Border, sides: Ints, steps: Ints) -> Border:
    """The border after the beginnings of sides (k,) moved by steps (k, 2) of one unit.

    The sides that changed must be measured again.
    """
    shifts = border.shifts.copy()
    shifts[border.rows[sides]] += steps
    begins = border.begins.copy()
    begins[sides] += steps
    is_moved = np.zeros(len(begins), bool)
    is_moved[sides] = True
    changed = is_moved | is_moved[border.nexts]
    segment_bounds = np.where(changed, np.nan, border.segment_bounds)
    sliver_bounds = np.where(changed, np.nan, border.sliver_bounds)
    return replace(
        border,
        begins=begins,
        ends=begins[border.nexts],
        shifts=shifts,
        segment_bounds=segment_bounds,
        sliver_bounds=sliver_bounds,
    )
