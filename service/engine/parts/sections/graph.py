"""The graph of sections: arcs in faces, and links along their borders, between nodes.

The nodes are those of the arcs, then the ends, then the joints, then the samples of links that have
a length. Arcs and links are lines between two nodes.

At each node of a closed solid an even number of lines meet. By rounding this may fail at nodes
inside faces and at ends; two such nodes of a face are then joined by a straight line.
"""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.row_batches import find_begins
from service.engine.parts.sections.borders import Borders
from service.engine.parts.sections.face_arcs import FaceArcs
from service.engine.parts.sections.links import Links
from service.engine.parts.sections.paths import list_portions, sample_edges
from service.engine.vectors import length

LONG = 2.0**-10
"""A link is short if it runs along less than this share of an edge, and its nodes are near each
other."""


@dataclass(frozen=True, eq=False, slots=True)
class Graph:
    """The lines of some sections.

    Attributes
    ----------
    lines : ndarray of int, shape (L, 2)
        The nodes of each line.
    sense : ndarray of float64, shape (L,)
        Above 0 for lines that should run from their first node to the second, below 0 for the other
        direction, 0 if unknown.
    points : ndarray of float64, shape (N, 3)
        The points of all nodes.
    column : ndarray of int, shape (N,)
        The plane of each node, among those of the call.
    moved : float
        No end of an arc was moved further than this.
    """

    lines: Ints
    sense: FloatArray
    points: FloatArray
    column: Ints
    moved: float


def build_graph(
    borders: Borders,
    arcs: FaceArcs,
    links: Links,
    nodes: tuple[FloatArray, Ints, Ints],
    sizes: tuple[int, int, float, float],
) -> Graph:
    """The graph of arcs in faces and of links.

    Parameters
    ----------
    nodes : (ndarray of float64 (N, 3), ndarray of int (N,), ndarray of int (N,))
        The points, columns and faces of the nodes of arcs, ends and joints; joints have no face.
    sizes : (int, int, float, float)
        The numbers of nodes of arcs, and of ends; the tolerance of paths along edges; and the
        length up to which links have no length: the end of an arc becomes the joint.
    """
    points, column, _ = nodes
    inner, end_count, tolerance, limit = sizes
    link_nodes = links.nodes.T + inner
    repairs = _find_repairs(np.concatenate([arcs.nodes.T, link_nodes]), nodes, inner + end_count)
    moved = float(length(points[repairs[:, 0]] - points[repairs[:, 1]], -1).max(initial=0.0))
    lines = np.concatenate([arcs.nodes.T, repairs])
    sense = np.where(borders.is_reversed[arcs.face], -arcs.sense, arcs.sense)
    # Short links: the first node becomes the second, or the other way if the first is a joint.
    link, coedge, start, stop = list_portions(borders, links)
    ranges = borders.edge_ranges[borders.coedge_edges[coedge]]
    width = ranges[:, 1] - ranges[:, 0]
    is_wide = (np.abs(stop - start) > LONG * width) & ~borders.is_point[
        borders.coedge_edges[coedge]
    ]
    is_long = np.bincount(link[is_wide], minlength=len(links)) > 0
    distance = length(points[link_nodes[:, 0]] - points[link_nodes[:, 1]], -1)
    is_long |= distance > limit
    is_end = end_count > links.nodes.T
    is_merged = ~is_long & is_end.any(axis=1)
    one, two = link_nodes[is_merged].T
    is_joint_first = ~is_end[is_merged, 0]
    target = np.arange(len(points))
    target[np.where(is_joint_first, two, one)] = np.where(is_joint_first, one, two)
    moved = max(moved, float(distance[is_merged].max(initial=0.0)))
    is_straight = ~is_merged & ~is_long
    is_back = borders.is_reversed[borders.coedge_faces[links.coedges[0]]]
    link_sense = np.where(is_back, -links.sense, links.sense)
    paths, owner, path_points, path_columns = _draw_paths(
        borders,
        (link, coedge, start, stop),
        is_long,
        (link_nodes, column),
        (len(points), tolerance),
    )
    lines = np.concatenate([lines, link_nodes[is_straight], paths])
    lines = _replace_nodes(target, lines)
    unknown = np.zeros(len(repairs))
    sense = np.concatenate([sense, unknown, link_sense[is_straight], link_sense[owner]])
    return Graph(
        lines,
        sense,
        np.concatenate([points, path_points]),
        np.concatenate([column, path_columns]),
        moved,
    )


def _replace_nodes(target: Ints, lines: Ints) -> Ints:
    """The lines after nodes have become other ones; nodes after those of `target` stay."""
    is_old = lines < len(target)
    return np.where(is_old, target[np.where(is_old, lines, 0)], lines)


def _find_repairs(lines: Ints, nodes: tuple[FloatArray, Ints, Ints], count: int) -> Ints:
    """Lines between nodes (of the first `count`) at which an odd number of lines meet.

    Near nodes of one face are joined first.
    """
    points, column, face = nodes
    degree = np.bincount(lines.ravel(), minlength=len(points))[:count]
    odd = (degree % 2 == 1).nonzero()[0]
    if not len(odd):
        return np.zeros((0, 2), np.intp)
    odd = odd[np.lexsort((odd, face[odd], column[odd]))]
    key = column[odd] * (int(face[odd].max()) + 1) + face[odd]
    begins = find_begins(key).tolist()
    pairs: list[tuple[int, int]] = []
    for first, last in zip(begins, [*begins[1:], len(odd)], strict=True):
        left = odd[first:last].tolist()
        while len(left) > 1:
            one = left.pop(0)
            away = length(points[left] - points[one], -1)
            pairs.append((one, left.pop(int(away.argmin()))))
    return np.array(pairs, np.intp).reshape(-1, 2)


def _draw_paths(
    borders: Borders,
    portions: tuple[Ints, Ints, FloatArray, FloatArray],
    is_long: Bools,
    links: tuple[Ints, Ints],
    sizes: tuple[int, float],
) -> tuple[Ints, Ints, FloatArray, Ints]:
    """Lines along the borders for long links, and the link of each; points and columns of nodes."""
    link, coedge, start, stop = portions
    link_nodes, column = links
    first_node, tolerance = sizes
    rows = is_long[link].nonzero()[0]
    edge = borders.coedge_edges[coedge[rows]]
    row, points = sample_edges(borders, edge, start[rows], stop[rows], tolerance)
    owner = link[rows[row]]
    node = first_node + np.arange(len(owner))
    long = is_long.nonzero()[0]
    # Node after node along each link: its first node, the samples, its last node.
    all_links = np.concatenate([long, owner, long])
    all_nodes = np.concatenate([link_nodes[long, 0], node, link_nodes[long, 1]])
    order = all_links.argsort(kind="stable")
    all_links, all_nodes = all_links[order], all_nodes[order]
    follows = all_links[1:] == all_links[:-1]
    lines = np.stack([all_nodes[:-1][follows], all_nodes[1:][follows]], axis=1)
    return lines, all_links[:-1][follows], points, column[link_nodes[owner, 0]]
