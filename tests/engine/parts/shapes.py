"""Solids whose crossings with rays, and insides, are known in closed form; and cracked faces."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from oracles.sheets import Array
from service.bases.arrays import Bools
from tests.breps import build_box
from tools.certify.part_curves import draw_arc, draw_segments, join_ends, reverse_loop
from tools.certify.part_documents import build_prism

Document = dict[str, Any]

CORNERS = np.array([[0.0, 0], [6, 0], [6, 2], [2, 2], [2, 5], [0, 5]])
"""The outline of a bracket."""

CENTER, RADIUS, HEIGHT = np.array([4.5, 1.0]), 0.6, 3.0


@dataclass
class Box:
    """A box between two corners."""

    low: Array
    high: Array

    def contains(self, points: Array) -> Bools:
        inside: Bools = np.all((points > self.low) & (points < self.high), axis=1)
        return inside

    def find_crossings(self, o: Array, d: Array) -> list[float]:
        with np.errstate(divide="ignore"):
            ends = np.sort([(self.low - o) / d, (self.high - o) / d], axis=0)
        first, last = ends[0].max(), ends[1].min()
        return [t for t in (first, last) if first < last and t > 0]


class Bracket:
    """A prism with an angular outline and a round hole."""

    def document(self) -> Document:
        radii = np.array([RADIUS, RADIUS])
        arcs = [draw_arc(CENTER, radii, a, a + np.pi / 2) for a in np.arange(4) * np.pi / 2]
        hole = reverse_loop(join_ends(arcs))
        return build_prism([draw_segments(CORNERS), hole], HEIGHT, np.zeros(2))

    def contains(self, points: Array) -> Bools:
        """By the crossing number of the outline."""
        x, y, z = points.T
        inside = np.zeros(len(points), bool)
        for (ax, ay), (bx, by) in zip(CORNERS, np.roll(CORNERS, -1, axis=0), strict=True):
            if ay != by:
                is_between = (ay > y) != (by > y)
                inside ^= is_between & (x < ax + (y - ay) * (bx - ax) / (by - ay))
        inside &= np.hypot(x - CENTER[0], y - CENTER[1]) > RADIUS
        result: Bools = inside & (z > 0) & (z < HEIGHT)
        return result

    def find_crossings(self, o: Array, d: Array) -> list[float]:
        """Where the ray meets planes or the round wall and is inside on one side alone."""
        roots = [(z - o[2]) / d[2] for z in (0.0, HEIGHT)]
        for a, b in zip(CORNERS, np.roll(CORNERS, -1, axis=0), strict=True):
            normal = np.array([b[1] - a[1], a[0] - b[0]])
            if normal @ d[:2]:
                roots.append(normal @ (a - o[:2]) / (normal @ d[:2]))
        across, way = o[:2] - CENTER, d[:2]
        roots += np.roots([way @ way, 2 * way @ across, across @ across - RADIUS**2]).tolist()
        t = np.sort([float(r.real) for r in np.array(roots) if abs(r.imag) < 1e-12 and r.real > 0])
        middles = np.concatenate([t[:1] / 2, (t[1:] + t[:-1]) / 2, t[-1:] + 1])
        inside = self.contains(o + middles[:, np.newaxis] * d)
        crossings: list[float] = t[inside[1:] != inside[:-1]].tolist()
        return crossings


def build_hollow_box() -> tuple[Document, Box, Box]:
    """A box with a void, and the two boxes."""
    outer = build_box((6, 5, 4))
    inner = build_box((1, 2, 1.5))
    shift = np.array([2.0, 1.5, 1.0])
    vertices = (np.array(inner["vertices"]) + shift).tolist()
    first_vertex, first_edge = len(outer["vertices"]), len(outer["edges"])
    faces = []
    for face in inner["faces"]:
        net = (np.array(face["surface"]["control_net"], float) + shift).tolist()
        (loop,) = face["loops"]
        moved = loop | {"edges": [edge + first_edge for edge in loop["edges"]]}
        faces.append({"surface": {"control_net": net}, "loops": [moved], "reversed": True})
    edges = [{"vertices": [v + first_vertex for v in e["vertices"]]} for e in inner["edges"]]
    document = outer | {
        "vertices": outer["vertices"] + vertices,
        "edges": outer["edges"] + edges,
        "faces": outer["faces"] + faces,
        "shells": [*outer["shells"], {"faces": list(range(6, 12)), "closed": True}],
    }
    boxes = Box(np.zeros(3), np.array([6.0, 5, 4])), Box(shift, shift + np.array([1, 2, 1.5]))
    return document, *boxes


def build_cracked(gap: float, *, tilt: float = 0.0) -> Document:
    """Two squares of side 5 whose borders are `gap` from the edge x = 5 between them.

    The second square rises by `tilt` along x.
    """

    def rise(x: float) -> float:
        return tilt * max(x - 5, 0.0)

    corners = [[x, y, rise(x)] for x in (0.0, 5.0, 10.0) for y in (0.0, 5.0)]
    pairs = [(0, 2), (2, 3), (3, 1), (1, 0), (2, 4), (4, 5), (5, 3)]
    share = gap / 5
    rings = [
        ([0, 1, 2, 3], [False] * 4, [(0, 0), (1 - share, 0), (1 - share, 1), (0, 1)]),
        ([4, 5, 6, 1], [False, False, False, True], [(share, 0), (1, 0), (1, 1), (share, 1)]),
    ]
    faces = []
    for start, (edges, flags, ring) in zip((0.0, 5.0), rings, strict=True):
        net = [[[x, y, rise(x)] for y in (0.0, 5.0)] for x in (start, start + 5)]
        pcurves = []
        for k, is_reversed in enumerate(flags):
            ends = [list(ring[k]), list(ring[(k + 1) % 4])]
            pcurves.append({"control_points": ends[::-1] if is_reversed else ends})
        loop = {"edges": edges, "reversed": flags, "pcurves": pcurves}
        faces.append({"surface": {"control_net": net}, "loops": [loop]})
    return {
        "type": "brep",
        "uncertainty": 3 * gap,
        "vertices": corners,
        "edges": [{"vertices": list(pair)} for pair in pairs],
        "faces": faces,
        "shells": [{"faces": [0, 1], "closed": False}],
    }
