"""Makes vertices from samples: decides which samples are one vertex, and computes its normal."""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import IndexArray, Ints, RealArray
from service.engine.clustering import find_leaders
from service.engine.plans.creases import Averages, chord_length, mean_normals


@dataclass(frozen=True, eq=False, slots=True)
class Welding:
    """Samples and their vertices.

    `vertex` (N,) is the vertex of each sample, `samples` (V,) the first sample of each vertex, and
    `welds` (V,) the first vertex at the same position.
    """

    vertex: Ints
    samples: Ints
    welds: Ints


def weld(
    same_position: Ints,
    used_samples: Ints | None,
    normals: RealArray | None,
    crease_angle: float,
    is_merged: bool,
    *,
    same_values: Ints | None = None,
) -> Welding:
    """Merges samples at one position whose normals nearly agree; writes their mean into `normals`.

    Vertices have the order of their first samples. So the vertices of a single patch have the order
    of its samples.

    Parameters
    ----------
    same_position : ndarray of int, shape (N,)
        For each sample, one sample at its position, the same for all samples there.
    used_samples : ndarray of int, optional
        Samples that occur in faces; by default, or without faces, all samples.
    normals : ndarray, shape (N, 3), or None
        Unit normals, if vertices have them.
    crease_angle : float
        Radians; samples whose normals are at a larger angle are not merged.
    is_merged : bool
        If False, each sample becomes a separate vertex.
    same_values : ndarray of int, optional
        For each sample, one sample at its position that has equal colours, texture coordinates and
        attributes. Samples with different values become separate vertices, but may share the mean
        of their normals.
    """
    leader = (
        merge_samples(same_position, normals, crease_angle, same_values)
        if is_merged
        else np.arange(len(same_position))
    )
    return number_vertices(same_position, leader, used_samples)


def merge_samples(
    same_position: Ints, normals: RealArray | None, crease_angle: float, same_values: Ints | None
) -> Ints:
    """For each sample, the sample whose vertex it shares; writes mean normals into `normals`.

    The parameters and the rules are as in `weld`.
    """
    leader = same_position if same_values is None else same_values
    if normals is not None:
        leader = find_leaders(same_position, normals, chord_length(crease_angle))
        own_numbers = np.arange(len(same_position))
        averages = Averages.from_leaders(leader)
        normals[averages.leaders] = mean_normals(normals, averages)
        if same_values is not None:
            followers = np.flatnonzero(leader != own_numbers)
            normals[followers] = normals[leader[followers]]
            # The values are whole numbers: different ones are further apart than 0.5.
            leader = find_leaders(leader, same_values[:, np.newaxis].astype(np.float64), 0.5)
    return leader


def number_vertices(same_position: Ints, leader: Ints, used_samples: Ints | None) -> Welding:
    """The vertices of samples; each sample shares the vertex of its `leader`.

    The parameters are as in `weld`; `leader[leader]` equals `leader`.
    """
    is_kept = leader == np.arange(len(same_position))
    if used_samples is not None and len(used_samples):
        is_used = np.zeros(len(same_position), dtype=bool)
        is_used[leader[used_samples]] = True
        is_kept &= is_used
    samples = np.flatnonzero(is_kept)
    vertices = np.arange(len(samples))
    # The first vertex at each position: in reverse order, it is written last, and stays.
    first = np.zeros(len(same_position), dtype=np.intp)
    first[same_position[samples[::-1]]] = vertices[::-1]
    # A sample without a face is not a vertex. `Mesh.grids`, which has a vertex for every sample,
    # gets the first vertex at the same position.
    number = first[same_position]
    number[samples] = vertices
    return Welding(number[leader], samples, first[same_position[samples]])


def drop_unused(welding: Welding, faces: tuple[IndexArray, IndexArray]) -> Welding:
    """The welding without the vertices that these faces do not use.

    If no face uses any vertex at a position, its vertices stay, because `Mesh.grids` has a vertex
    for every sample.
    """
    is_used = np.zeros(len(welding.samples), dtype=bool)
    for rows in faces:
        is_used[rows] = True
    # Indexed by the first vertex at each position: whether faces use any vertex there.
    is_shown = np.zeros_like(is_used)
    is_shown[welding.welds[is_used]] = True
    is_used |= ~is_shown[welding.welds]
    kept_vertices = np.flatnonzero(is_used)
    number = np.cumsum(is_used) - 1
    first_at_position = np.zeros_like(number)
    first_at_position[welding.welds[kept_vertices[::-1]]] = number[kept_vertices[::-1]]
    vertex = np.where(is_used, number, first_at_position[welding.welds])
    return Welding(
        vertex[welding.vertex],
        welding.samples[kept_vertices],
        first_at_position[welding.welds[kept_vertices]],
    )


def find_shared_positions(welding: Welding | None) -> IndexArray | None:
    """For each vertex, the first vertex at its position; None if all positions differ."""
    if welding is None or bool((welding.welds == np.arange(len(welding.welds))).all()):
        return None
    return welding.welds.astype(np.uint32)


def count_positions(vertices: int, welds: IndexArray | None) -> int:
    """The number of distinct positions."""
    if welds is None:
        return vertices
    return int(np.count_nonzero(welds == np.arange(vertices)))
