"""From triangulations to samples: flat triangles, parameters of patches, values of channels.

**Flat triangles** are omitted: triangles of which two corners have equal positions in the file. A
side that is nearly a point, for example, has vertices that differ in float64 but not in float32. If
the stored positions of two vertices joined by an edge are equal, they become one vertex, and the
triangles at that edge are removed. The mesh stays closed where it was closed.

**Samples.** A place on a knot line inside a face belongs to the patches on both sides of the line.
If the surface has a crease along the line, it has two normals at this place. So triangles on
different sides get separate samples, which later become one vertex if their normals agree. A
triangle that spans several patches uses, at each of its corners, the patch on the side of the
triangle.

Proof in docs/proofs.md: "Omitted flat triangles".
"""

from dataclasses import dataclass, replace

import numpy as np

from service.bases.arrays import Bools, FloatArray, IndexArray, Ints, RealArray
from service.bases.bernstein import bernstein
from service.bases.row_batches import row_slices
from service.bases.triangle import degree_of
from service.bases.triangle_basis import triangle_bernstein
from service.engine.adaptive.drafts.draft import Triangulation
from service.engine.bounds.faces import SPAN, Faces
from service.engine.clustering import DisjointSets
from service.engine.curvatures.rows import (
    LimitCurvatures,
    clip_to_storable,
    stretch_patches,
    to_channels,
)
from service.engine.evaluation.normals import group_by_batch
from service.engine.evaluation.triangle_nets import to_barycentric
from service.engine.mesh.channels import CHUNK_VALUES, ChannelRows, find_limits
from service.engine.mesh.places import SurfacePlaces
from service.engine.scratch import Real
from service.surface.batches import TrianglePatches
from service.surface.lowered import PatchModel

EDGES = ((0, 1), (1, 2), (2, 0))
"""The corners at both ends of each edge of a triangle."""


def drop_flat_triangles(triangulation: Triangulation, stored: RealArray) -> Triangulation:
    """The triangulation without triangles of which two corners are stored as equal positions.

    `stored` (V, 3) are its vertices as the file stores them. `triangulation` itself is returned
    if it has no flat triangle, or if beside one of them no triangle stays.
    """
    corners = triangulation.vertex[triangulation.triangles]
    following = corners[:, [1, 2, 0]]
    equal = np.logical_and.reduce([x.take(corners) == x.take(following) for x in stored.T])
    if not equal.any():
        return triangulation
    pairs = np.concatenate([corners[equal[:, k]][:, [i, j]] for k, (i, j) in enumerate(EDGES)])
    # For each vertex the least of those with which the pairs unite it.
    ends, number = np.unique(pairs, return_inverse=True)
    sets = DisjointSets(len(ends))
    for first, second in number.reshape(-1, 2).tolist():
        sets.unite(first, second)
    vertex = np.arange(len(stored))
    vertex[ends] = ends[sets.list_roots()]
    corners = vertex[corners]
    flat = (corners == corners[:, [1, 2, 0]]).any(axis=1)
    beside = find_triangles_beside(triangulation.face[triangulation.triangles[:, 0]], corners, flat)
    if (beside < 0).any():
        return triangulation
    raised = _raise_bounds(triangulation.bounds, flat, beside)
    mesh_bounds = triangulation.mesh_bounds
    if mesh_bounds is not None:
        mesh_bounds = _raise_bounds(mesh_bounds, flat, beside)[~flat]
    return replace(
        triangulation,
        vertex=vertex[triangulation.vertex],
        triangles=triangulation.triangles[~flat],
        bounds=raised[~flat],
        mesh_bounds=mesh_bounds,
    )


def find_triangles_beside(face: Ints, corners: Ints, flat: Bools) -> Ints:
    """For each flat triangle a triangle of its face that stays and has its segment; or −1.

    `face`, `corners` and `flat` have the face, the three merged vertices and the mark of each
    triangle; the segment of a flat triangle joins its two different vertices.
    """
    staying = np.flatnonzero(~flat)
    edges = np.sort(corners[staying][:, EDGES].reshape(-1, 2), axis=1)
    size = int(corners.max()) + 1
    keys = (face[staying].repeat(3) * size + edges[:, 0]) * size + edges[:, 1]
    order = np.argsort(keys, kind="stable")
    # Two of the three sorted corners are equal, so the first and the last end the segment.
    ends = np.sort(corners[flat], axis=1)
    segments = (face[flat] * size + ends[:, 0]) * size + ends[:, 2]
    if not len(keys):
        return np.full(len(segments), -1)
    row = order[np.minimum(np.searchsorted(keys, segments, sorter=order), len(keys) - 1)]
    return np.where(keys[row] == segments, staying[row // 3], -1)


def _raise_bounds(bounds: FloatArray, flat: Bools, beside: Ints) -> FloatArray:
    """Bounds of all triangles; a triangle beside a flat triangle takes over its bound if larger."""
    raised = bounds.copy()
    np.maximum.at(raised, beside, bounds[flat])
    return raised


@dataclass(frozen=True, eq=False, slots=True)
class PatchPlaces:
    """N samples, given by parameters of patches.

    Attributes
    ----------
    patch : ndarray of int, shape (N,)
        Numbers of patches in the model.
    u, v : ndarray of float64, shape (N,)
        Parameters of the patches, in [0, 1]; exact. A triangular patch, as a face, is a square of
        which one side is a point: its own parameters are (u (1 − v), v).
    vertex : ndarray of int, shape (N,)
        The vertex of the triangulation at each sample.
    """

    patch: Ints
    u: FloatArray
    v: FloatArray
    vertex: Ints


def find_samples(
    faces: Faces, triangulation: Triangulation
) -> tuple[PatchPlaces, Ints, IndexArray]:
    """The samples that triangles use, their faces (N,), and the corners (T, 3) of triangles.

    Corners are numbers of samples.
    """
    spans = faces.spans.take(triangulation.face, axis=1)
    # For each corner: 1 if its triangle is before a knot line of u through it, plus 2 if of v.
    before = np.zeros(triangulation.triangles.shape, dtype=np.intp)
    for axis, at in enumerate((triangulation.u, triangulation.v)):
        inner = (at % SPAN == 0) & (at > 0) & (at < spans[axis] * SPAN)
        if inner.any():
            # A triangle with a corner on a knot line is judged by the mean of its three corners.
            places = at[triangulation.triangles]
            is_before = places.sum(axis=1, keepdims=True) < 3 * places
            before |= (inner[triangulation.triangles] & is_before).astype(np.intp) << axis
    # Each sample of the triangulation has four keys, one for each patch that may be around it.
    key = triangulation.triangles * 4 + before
    used = np.zeros(4 * len(triangulation.face), dtype=bool)
    used[key] = True
    number = np.cumsum(used, dtype=np.uint32) - np.uint32(1)
    row, row_before = np.divmod(used.nonzero()[0], 4)
    span_u, u = _split_places(triangulation.u[row], row_before & 1, spans[0, row])
    span_v, v = _split_places(triangulation.v[row], row_before >> 1, spans[1, row])
    face = triangulation.face[row]
    patch = faces.first[face] + span_u * faces.stride[face] + span_v
    return PatchPlaces(patch, u, v, triangulation.vertex[row]), face, number[key]


def _split_places(at: Ints, before: Ints, spans: Ints) -> tuple[Ints, FloatArray]:
    """Span and parameter of places along one direction; the last place is in the last span.

    `before` is 1 for places on a knot line that belong to the span before it, otherwise 0.
    """
    span = np.minimum(at // SPAN, spans - 1) - before
    return span, (at - span * SPAN) / SPAN


def find_places(model: PatchModel, faces: Faces, samples: PatchPlaces, face: Ints) -> SurfacePlaces:
    """The places of samples on faces, (N,); `face` (N,) are those of the samples."""
    span_u, span_v = np.divmod(samples.patch - faces.first[face], faces.stride[face])
    at = np.stack([span_u + samples.u, span_v + samples.v], axis=1) * SPAN
    return SurfacePlaces(model, faces, face, at)


def evaluate_channels(
    model: PatchModel, samples: PatchPlaces, dtype: Real, *, uvs: bool
) -> tuple[ChannelRows, ...]:
    """All channels of the model at samples.

    If `uvs` is true and the model has no texture coordinates, parameters are added as `uvs`.
    """
    channels = model.batches[0].channels
    evaluated = [
        ChannelRows(channel.name, channel.kind, evaluate_channel(model, samples, number, dtype))
        for number, channel in enumerate(channels)
    ]
    if uvs and not any(channel.kind == "uvs" for channel in channels):
        rows: RealArray = _find_parameters(model, samples).astype(dtype)
        evaluated.append(ChannelRows("uvs", "uvs", rows, is_exact=True))
    return tuple(evaluated)


def evaluate_curvatures(
    model: PatchModel, samples: PatchPlaces, dtype: Real
) -> tuple[ChannelRows, ...]:
    """Channels of Gaussian and mean curvature."""
    values = np.empty((2, len(samples.patch)), dtype=dtype)
    curvatures = LimitCurvatures()
    for batch, first, rows in group_by_batch(model.batches, samples.patch):
        index, u, v = samples.patch[rows] - first, samples.u[rows], samples.v[rows]
        if isinstance(batch, TrianglePatches):
            u = u * (1.0 - v)
        values[:, rows] = clip_to_storable(
            curvatures.curvatures(stretch_patches(batch, model.stretch), index, u, v)
        )
    return to_channels(model, values)


def evaluate_channel(
    model: PatchModel, samples: PatchPlaces, number: int, dtype: Real
) -> FloatArray:
    """Values (N, d) of one channel, computed in float64."""
    values = np.empty((len(samples.patch), model.batches[0].channels[number].dimension))
    for batch, first, rows in group_by_batch(model.batches, samples.patch):
        nets = batch.channels[number].nets
        for block in row_slices(len(rows), nets[0].size, CHUNK_VALUES):
            chosen = rows[block]
            nets_of_samples = nets[samples.patch[chosen] - first]
            u, v = samples.u[chosen], samples.v[chosen]
            if isinstance(batch, TrianglePatches):
                barycentric = to_barycentric(u * (1.0 - v), v)
                basis = triangle_bernstein(degree_of(nets.shape[1]), barycentric)
                values[chosen] = np.einsum("km,mkd->md", basis, nets_of_samples)
            else:
                along_u, along_v = (
                    bernstein(nets.shape[axis] - 1, t) for axis, t in ((1, u), (2, v))
                )
                lines = np.einsum("mi,mijd->mjd", along_u, nets_of_samples)
                values[chosen] = np.einsum("mj,mjd->md", along_v, lines)
    if model.batches[0].channels[number].kind == "colors":
        np.clip(values, 0.0, 1.0, out=values)
    # Adding 0.0 turns -0.0 into 0.0.
    return (values + 0.0).astype(dtype)


def _find_parameters(model: PatchModel, samples: PatchPlaces) -> FloatArray:
    """Parameters (N, 2) of samples: (u (1 − v), v) of triangular patches, otherwise (u, v).

    They are in the domain of the surface if the model has domains, otherwise in the patch.
    """
    parameters = np.stack([samples.u, samples.v], axis=1)
    for batch, _, rows in group_by_batch(model.batches, samples.patch):
        if isinstance(batch, TrianglePatches):
            parameters[rows, 0] *= 1.0 - parameters[rows, 1]
    if model.domains:
        for axis, limits in enumerate(find_limits(samples.patch, model.domains)):
            low, high = limits.T
            parameters[:, axis] = (1.0 - parameters[:, axis]) * low + parameters[:, axis] * high
    return parameters
