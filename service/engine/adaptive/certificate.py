"""The certificate: a proved bound of the distance from every part of a surface to its mesh."""

from dataclasses import dataclass

import numpy as np

from service.bases.arrays import Bools, FloatArray, Ints
from service.bases.chunks import chunks
from service.engine.adaptive.blossoms import box_nets, half_nets, triangle_nets
from service.engine.adaptive.clip import Pieces, clipped
from service.engine.adaptive.distance import reach
from service.engine.adaptive.faces import Faces
from service.engine.adaptive.goal import Goal
from service.engine.adaptive.ground import Ground, Nets
from service.engine.adaptive.heights import highest
from service.engine.adaptive.hosts import Hosts, hosts_of

CHUNK = 1 << 17
"""Numbers of the nets that are worked on at a time: all that is made of them stays in the cache."""

UNIT = 2.0**-53
"""Half the distance from 1 to the next number: what one rounding may do."""

DIRECT = 8
"""Degree up to which nets of triangles are computed as such."""


@dataclass(frozen=True, eq=False, slots=True)
class Parts:
    """m triangles of places, and the triangles of the mesh that their surface is measured against.

    Attributes
    ----------
    face : ndarray of int, shape (m,)
    corners : ndarray of int, shape (m, 3, 2)
        Places of the face. Neighbouring parts share whole edges.
    host : ndarray of int, shape (m, 3)
        The vertices of the triangle of the mesh: those at the corners, in their order, if the part
        is its own.
    across : ndarray of int, shape (m, 3)
        The vertex opposite edge (k, k + 1) of the host in the triangle beyond it; -1 if there is
        none or it is not known.
    own : ndarray of bool, shape (m,), or None
        Whether the host is the image of the part; None if all are.
    """

    face: Ints
    corners: Ints
    host: Ints
    across: Ints
    own: Bools | None = None


@dataclass(frozen=True, eq=False, slots=True)
class Bounds:
    """What is proved of m parts; see `Triangulation`.

    Attributes
    ----------
    deviation : ndarray of float64, shape (m,)
        No point of the part is further than this from the mesh.
    mesh : ndarray of float64, shape (m,), or None
        No point of the host is further than this from the surface; 0 where the part is not its own.
    allowed : ndarray of float64, shape (m,)
        What the goal allows so near to the eye.
    """

    deviation: FloatArray
    mesh: FloatArray | None
    allowed: FloatArray

    @property
    def passed(self) -> Bools:
        """Which parts meet the goal."""
        met: Bools = self.deviation <= self.allowed
        if self.mesh is not None:
            met &= self.mesh <= 2 * self.allowed
        return met


def certify(
    ground: Ground, faces: Faces, parts: Parts, positions: FloatArray, goal: Goal
) -> Bounds:
    """Bounds of the distances between parts of the surface and the mesh of these positions (V, 3).

    The positions are those that are stored, in model coordinates.
    """
    pieces = clipped(faces, parts.face, np.moveaxis(parts.corners, 0, -1))
    right, order = _right_angles(pieces.corners)
    found, distance = np.empty(len(pieces.part)), np.zeros(len(pieces.part))
    for nets, here in ground.by_group(pieces.patch):
        for halves in (True, False):
            rows = here[right[here] == halves]
            for chunk in chunks(len(rows), _room(nets), CHUNK):
                some = rows[chunk]
                job = _job(ground, nets, pieces, some, parts=parts, positions=positions)
                places = np.take_along_axis(
                    pieces.places[..., some], order[:, np.newaxis, some], axis=0
                )
                net = _over(job, places, halves)
                found[some] = job.restored(_deviations(job, net))
                if goal.view is not None:
                    distance[some] = job.distances(net, goal.view.eye)
    count = len(parts.face)
    deviation = _joined(np.maximum, found, pieces.part, count)
    near = _joined(np.minimum, distance, pieces.part, count)
    return Bounds(deviation, None, goal.allowed(near))


def _right_angles(corners: Ints) -> tuple[Bools, Ints]:
    """Which triangles (3, 2, M) are halves of boxes, and their corners in order (3, M).

    First the corner at the right angle, then the one along u, then the one along v.
    """
    u, v = corners[:, 0], corners[:, 1]
    right = np.zeros(u.shape[1], dtype=bool)
    order = np.empty(u.shape, dtype=np.intp)
    order[:] = np.arange(3)[:, np.newaxis]
    for k in range(3):
        for one, two in ((k - 2, k - 1), (k - 1, k - 2)):
            here = (v[k] == v[one]) & (u[k] == u[two])
            right |= here
            order[:, here] = np.array([[k], [one % 3], [two % 3]])
    return right, order


@dataclass(frozen=True, eq=False, slots=True)
class _Job:
    """Some pieces over patches of one degree, in the frames of their hosts.

    Units are such that no coordinate about the middle of the patch is above 1: a power of two
    for each piece, 2^exponent, so nothing is rounded and no square is lost.

    Attributes
    ----------
    nets : ndarray of float64, shape (p+1, q+1, D, m)
    hosts : Hosts
    middle : ndarray of float64, shape (3, m)
    exponent : ndarray of int, shape (m,)
    slack : ndarray of float64, shape (m,)
        What the roundings of the positions and of the patches may do. Model units.
    """

    nets: FloatArray
    hosts: Hosts
    middle: FloatArray
    exponent: Ints
    slack: FloatArray

    @property
    def degree(self) -> tuple[int, int]:
        return self.nets.shape[0] - 1, self.nets.shape[1] - 1

    @property
    def rational(self) -> bool:
        return int(self.nets.shape[2]) == 4

    def restored(self, bound: FloatArray) -> FloatArray:
        """A bound in model units, all rounding included."""
        safe = bound + self.hosts.tilt + UNIT * roundings(*self.degree)
        bounds: FloatArray = np.ldexp(safe, self.exponent) + self.slack
        return bounds

    def distances(self, net: FloatArray, eye: FloatArray) -> FloatArray:
        """Lower bounds of the distances between the pieces and the eye, by boxes about nets."""
        seen = self.hosts.framed(np.ldexp(eye[:, np.newaxis] - self.middle, -self.exponent))
        points = _points(net)
        gap = np.maximum(points.min(axis=0) - seen, seen - points.max(axis=0))
        gap = np.maximum(gap, 0.0)
        length = np.sqrt(gap[0] * gap[0] + gap[1] * gap[1] + gap[2] * gap[2])
        # Far from the middle the eye's own coordinates are rounded.
        length = length * (1.0 - 2.0**-40) - UNIT * roundings(*self.degree)
        least: FloatArray = np.maximum(np.ldexp(length, self.exponent) - self.slack, 0.0)
        return least


def _job(
    ground: Ground, nets: Nets, pieces: Pieces, some: Ints, *, parts: Parts, positions: FloatArray
) -> _Job:
    """Some of the pieces."""
    patch, part = pieces.patch[some], pieces.part[some]
    middle = ground.middles[:, patch]
    beyond = parts.across[part].T
    vertices = np.stack([positions[row].T for row in parts.host[part].T])
    local = vertices - middle
    size = np.maximum(ground.sizes[patch], np.abs(local).max(axis=(0, 1)))
    exponent = np.frexp(size)[1]
    across = np.stack([positions[row].T for row in beyond]) - middle
    hosts = hosts_of(np.ldexp(local, -exponent), np.ldexp(across, -exponent), beyond >= 0)
    net = nets.take(ground.row[patch])
    net[:, :, :3] = np.ldexp(net[:, :, :3], -exponent)
    slack = 4 * UNIT * np.abs(vertices).max(axis=(0, 1)) + ground.lowering
    return _Job(hosts.framed(net), hosts, middle, exponent, slack)


def _over(job: _Job, places: FloatArray, halves: bool) -> FloatArray:
    """Nets (N, D, m) over triangles of parameters (3, 2, m); of high degree, over their boxes."""
    u, v = places[:, 0], places[:, 1]
    if sum(job.degree) > DIRECT:
        boxes = box_nets(job.nets, (u.min(axis=0), u.max(axis=0)), (v.min(axis=0), v.max(axis=0)))
        return boxes.reshape(-1, *boxes.shape[2:])
    if halves:
        return half_nets(box_nets(job.nets, (u[0], u[1]), (v[0], v[2])))
    return triangle_nets(job.nets, [*u], [*v])


def _points(net: FloatArray) -> FloatArray:
    """Points (N, 3, m) of nets that may be homogeneous."""
    return net if net.shape[1] == 3 else net[:, :3] / net[:, 3:]


def _deviations(job: _Job, net: FloatArray) -> FloatArray:
    """Bounds for nets (N, D, m) in the frames of their hosts."""
    points = _points(net)
    x, y, h = (np.ascontiguousarray(points[:, c]) for c in range(3))
    furthest = reach(x, y, h, job.hosts)
    degree = sum(job.degree)
    if degree > DIRECT:
        return furthest.bound(furthest.height)
    rise = highest(np.ascontiguousarray(net[:, 2]), degree)
    return furthest.bound(rise / net[:, 3].min(axis=0) if job.rational else rise)


def roundings(p: int, q: int) -> int:
    """What rounding may do to a distance, in units in the last place of 1 (see the module)."""
    path = 4 + 3 * max(p, q) + 2 * (p + q) + (p + 1) * (q + 1)
    return 4 * path + 4 * (p + q) + 256


def _room(nets: Nets) -> int:
    """Numbers that are made of one net."""
    p, q = nets.degree
    if p + q > DIRECT:
        return 4 * (p + 1) * (q + 1) * 4
    return 3 * (p + q + 1) * (p + q + 2)


def _joined(choose: np.ufunc, values: FloatArray, part: Ints, count: int) -> FloatArray:
    """The largest, or the least, value of the pieces of each part."""
    if len(values) == count:
        return values
    chosen: FloatArray = choose.reduceat(values, np.searchsorted(part, np.arange(count)))
    return chosen
