"""The topology of a mesh, computed by counting the edges of its faces."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components


@dataclass(frozen=True)
class Topology:
    """Counts of a polygon mesh.

    `boundary` edges belong to one face, `non_manifold` edges to three or more; `misoriented` edges
    have the same direction in two faces. `degenerate` faces have a vertex twice. The faces of a
    component are connected by common edges; a common vertex is not enough. Vertices that no face
    uses are not counted.
    """

    vertices: int
    edges: int
    faces: int
    boundary: int
    non_manifold: int
    misoriented: int
    degenerate: int
    components: int

    @property
    def euler(self) -> int:
        """Euler's characteristic: 2 for a sphere, 0 for a torus or a tube, 1 for a disc."""
        return self.vertices - self.edges + self.faces

    @property
    def watertight(self) -> bool:
        """Whether every edge belongs to exactly two faces, and has opposite directions in them."""
        return not (self.boundary or self.non_manifold or self.misoriented)


def count_topology(faces: Iterable[Sequence[int]]) -> Topology:
    """All counts; each face is a polygon, given by the indices of its vertices in order."""
    loops = [faces] if isinstance(faces, np.ndarray) else _group_faces(faces)
    ends = np.concatenate(
        [_list_edge_ends(each) for each in loops] or [np.empty((0, 2), dtype=np.int64)]
    )
    _, directed_uses = np.unique(_number_edges(ends), return_counts=True)
    _, edge, uses = np.unique(
        _number_edges(np.sort(ends, axis=1)), return_inverse=True, return_counts=True
    )
    # A graph whose nodes are faces and edges; each face is joined to its edges.
    corner_counts = np.repeat([each.shape[1] for each in loops], [len(each) for each in loops])
    count = len(corner_counts)
    owner = np.repeat(np.arange(count), corner_counts.astype(np.int64))
    size = count + len(uses)
    graph = coo_array((np.ones(len(edge)), (owner, count + edge)), (size, size))
    repeats = [np.diff(np.sort(each, axis=1), axis=1) == 0 for each in loops]
    return Topology(
        vertices=len(np.unique(ends)),
        edges=len(uses),
        faces=count,
        boundary=int((uses == 1).sum()),
        non_manifold=int((uses > 2).sum()),
        misoriented=int((directed_uses > 1).sum()),
        degenerate=sum(int(each.any(axis=1).sum()) for each in repeats),
        components=int(connected_components(graph, directed=False)[0]) if count else 0,
    )


def _group_faces(faces: Iterable[Sequence[int]]) -> list[NDArray[np.int64]]:
    """Faces as arrays (m, k), one for each number k of corners."""
    lists = [list(face) for face in faces]
    sizes = sorted({len(face) for face in lists})
    return [np.array([face for face in lists if len(face) == size]) for size in sizes]


def _list_edge_ends(loops: NDArray[np.int64]) -> NDArray[np.int64]:
    """Both vertices (m k, 2) of each edge, face by face."""
    return np.stack([loops, np.roll(loops, -1, axis=1)], axis=2).reshape(-1, 2).astype(np.int64)


def _number_edges(ends: NDArray[np.int64]) -> NDArray[np.int64]:
    """A number for each pair of vertices (m, 2)."""
    return ends[:, 0] * (int(ends.max(initial=0)) + 1) + ends[:, 1]


def weld_by_position(positions: np.ndarray, faces: np.ndarray) -> NDArray[np.int64]:
    """The faces with every vertex replaced by the first one whose position has the same bits."""
    # Adding 0.0 makes −0.0 and 0.0 one position.
    _, first, number = np.unique(positions + 0.0, axis=0, return_index=True, return_inverse=True)
    welded: NDArray[np.int64] = first[number.ravel()][faces]
    return welded


def volume(positions: np.ndarray, triangles: np.ndarray) -> float:
    """Signed volume by the divergence theorem, Σ a · (b × c) / 6; positive if normals point out."""
    total = Fraction(0)
    points = [[Fraction(x) for x in row] for row in positions.tolist()]
    for i, j, k in triangles.tolist():
        (ax, ay, az), (bx, by, bz), (cx, cy, cz) = points[i], points[j], points[k]
        total += ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx)
    return float(total / 6)


def winding_agreement(
    positions: np.ndarray, normals: np.ndarray, triangles: np.ndarray
) -> np.ndarray:
    """For each triangle, Σ n · (vertex normal) over its corners, n its unit normal; shape (T,).

    The value is 3 if all normals agree, and negative if the winding is wrong.
    """
    a, b, c = (positions[triangles[:, k]].astype(float) for k in range(3))
    face_normals = np.cross(b - a, c - a)
    size = np.linalg.norm(face_normals, axis=1)
    unit_normals = face_normals / np.where(size > 0, size, 1.0)[:, None]
    vertex_normals = normals[triangles].astype(float).sum(axis=1)
    agreement: np.ndarray = (unit_normals * vertex_normals).sum(axis=1)
    return agreement
