"""What the faces of a mesh make, found by counting their edges one at a time."""

from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from fractions import Fraction

import numpy as np


@dataclass(frozen=True)
class Topology:
    """Counts of a polygon mesh.

    `boundary` edges belong to one face, `non_manifold` edges to three or more; `misoriented`
    edges are run through twice in the same direction by two faces. `degenerate` faces name a
    vertex twice. Components hang together by edges: touching in a point is not enough. `euler`
    is V − E + F over the vertices in use.
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
        """Every edge belongs to exactly two faces, which run it in opposite directions."""
        return not (self.boundary or self.non_manifold or self.misoriented)


def topology(faces: Iterable[Sequence[int]]) -> Topology:
    """Count everything; the faces are polygons given by their vertices in order."""
    loops = [[int(i) for i in face] for face in faces]
    directed = Counter(edge for loop in loops for edge in _edges(loop))
    uses: Counter[frozenset[int]] = Counter()
    for (a, b), times in directed.items():
        uses[frozenset((a, b))] += times
    return Topology(
        vertices=len({i for loop in loops for i in loop}),
        edges=len(uses),
        faces=len(loops),
        boundary=sum(times == 1 for times in uses.values()),
        non_manifold=sum(times > 2 for times in uses.values()),
        misoriented=sum(times > 1 for times in directed.values()),
        degenerate=sum(len(set(loop)) < len(loop) for loop in loops),
        components=_components(loops),
    )


def _edges(loop: list[int]) -> list[tuple[int, int]]:
    return list(zip(loop, loop[1:] + loop[:1], strict=True))


def _components(loops: list[list[int]]) -> int:
    """Union-find over the faces, joined wherever they have an edge in common."""
    parent = list(range(len(loops)))
    owner: dict[frozenset[int], int] = {}

    def root(i: int) -> int:
        while parent[i] != i:
            parent[i] = parent[parent[i]]
            i = parent[i]
        return i

    for face, loop in enumerate(loops):
        for edge in _edges(loop):
            parent[root(face)] = root(owner.setdefault(frozenset(edge), face))
    return len({root(face) for face in range(len(loops))})


def welded_by_position(positions: np.ndarray, faces: np.ndarray) -> list[list[int]]:
    """The faces with every vertex replaced by the first one whose position has the same bits."""
    first: dict[tuple[float, ...], int] = {}
    # Adding 0.0 makes −0.0 and 0.0 one position.
    places = [first.setdefault(tuple(p), k) for k, p in enumerate((positions + 0.0).tolist())]
    return [[places[i] for i in face] for face in faces.tolist()]


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
    """For each triangle, (b − a) × (c − a) · (sum of its normals), in units of its size."""
    a, b, c = (positions[triangles[:, k]].astype(float) for k in range(3))
    facing = np.cross(b - a, c - a)
    size = np.linalg.norm(facing, axis=1)
    towards = normals[triangles].astype(float).sum(axis=1)
    agreement: np.ndarray = (facing / np.where(size > 0, size, 1.0)[:, None] * towards).sum(axis=1)
    return agreement
