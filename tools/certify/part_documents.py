"""Writes breps as JSON documents: prisms, plates, and faces trimmed in parameters alone."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise
from typing import Any, TypeAlias

import numpy as np

from oracles.brep_documents import Array, Spline
from tools.certify.part_curves import Loop, Random

Document: TypeAlias = dict[str, Any]


@dataclass
class Part:
    """A part to mesh.

    `truth` is a document with the same surfaces and the right parameter curves on all loops, from
    which points are sampled; it is `document` itself if that has them. `slack` is how far points of
    the truth may be from the faces that the document describes, `relative` the relative tolerance.
    """

    document: Document
    relative: float
    truth: Document | None = None
    is_closed: bool = False
    slack: float = 0.0


@dataclass
class Builder:
    """Collects the vertices, edges and faces of a document."""

    vertices: list[list[float]] = field(default_factory=list)
    edges: list[Document] = field(default_factory=list)
    faces: list[Document] = field(default_factory=list)

    def add_vertex(self, point: Array) -> int:
        self.vertices.append([float(x) for x in point])
        return len(self.vertices) - 1

    def add_edge(self, start: int, end: int, curve: Spline | None = None) -> int:
        """An edge between two vertices; without a curve it is a line."""
        edge: Document = {"vertices": [start, end]}
        if curve is not None:
            edge["curve"] = write_curve(curve)
        self.edges.append(edge)
        return len(self.edges) - 1

    def add_face(
        self, surface: Document, loops: Sequence[Sequence[tuple[int, bool, Spline]]], *,
        is_reversed: bool = False
    ) -> None:  # fmt: skip
        """A face; a coedge is an edge, whether it runs against it, and the parameter curve."""
        self.faces.append(
            {
                "name": f"face {len(self.faces)}",
                "surface": surface,
                "reversed": is_reversed,
                "loops": [
                    {
                        "edges": [edge for edge, _, _ in loop],
                        "reversed": [against for _, against, _ in loop],
                        "pcurves": [write_curve(curve) for _, _, curve in loop],
                    }
                    for loop in loops
                ],
            }
        )

    def write(self, *, is_closed: bool) -> Document:
        """The document, with one shell."""
        shell = {"faces": list(range(len(self.faces))), "closed": is_closed}
        return {
            "type": "brep", "up": "y", "vertices": self.vertices, "edges": self.edges,
            "faces": self.faces, "shells": [shell],
        }  # fmt: skip


def write_curve(curve: Spline) -> Document:
    """The document of a B-spline curve."""
    document: Document = {
        "type": "bspline",
        "degree": curve.degree,
        "knots": curve.knots.tolist(),
        "control_points": curve.points.tolist(),
    }
    if np.ptp(curve.weights) > 0:
        document["weights"] = curve.weights.tolist()
    return document


def write_plane(low: Array, high: Array, lift: Callable[[Array], Array]) -> Document:
    """A plane over the rectangle of x and y, which are its parameters; `lift` gives its points."""
    corners = np.array([[[x, y] for y in (low[1], high[1])] for x in (low[0], high[0])])
    knots = [[a, a, b, b] for a, b in zip(low.tolist(), high.tolist(), strict=True)]
    net = lift(corners.reshape(-1, 2)).reshape(2, 2, 3).tolist()
    return {"type": "bspline", "degree": [1, 1], "knots": knots, "control_net": net}


def write_sweep(bottom: Spline, top: Spline) -> Document:
    """The ruled surface between two curves (n, 3) with the same knots and weights; v is 0 to 1."""
    surface: Document = {
        "type": "bspline",
        "degree": [bottom.degree, 1],
        "knots": [bottom.knots.tolist(), [0.0, 0, 1, 1]],
        "control_net": np.stack([bottom.points, top.points], axis=1).tolist(),
    }
    if np.ptp(bottom.weights) > 0:
        surface["weights"] = np.stack([bottom.weights] * 2, axis=1).tolist()
    return surface


def draw_line(
    start: Sequence[float], end: Sequence[float], domain: Sequence[float] = (0, 1)
) -> Spline:
    """A line in parameters over a domain."""
    a, b = map(float, domain)
    return Spline(1, np.array([a, a, b, b]), np.array([start, end], dtype=float), np.ones(2))


def lift_plane(height: float, slope: Array) -> Callable[[Array], Array]:
    """Points (n, 3) of z = height + slope · (x, y) above points (n, 2)."""
    return lambda points: np.column_stack([points, height + points @ slope])


def build_prism(
    loops: list[Loop], height: float, slope: Array, *, tall: float | None = None
) -> Document:
    """The closed solid above loops in the plane z = 0, below z = height + slope · (x, y).

    With `tall` the sides reach up to this z, and are trimmed by the upper border: its parameter
    curves are then curves of a higher degree.
    """
    builder = Builder()
    points = np.concatenate([curve.points for loop in loops for curve in loop])
    low, high = points.min(axis=0), points.max(axis=0)
    low, high = low - 0.1 * (high - low), high + 0.1 * (high - low)
    lifts = lift_plane(0.0, np.zeros(2)), lift_plane(height, slope)
    ends: list[list[list[tuple[int, bool, Spline]]]] = [[], []]
    for loop in loops:
        corners = [
            [builder.add_vertex(lift(curve.points[:1])[0]) for curve in loop] for lift in lifts
        ]
        posts = [builder.add_edge(a, b) for a, b in zip(*corners, strict=True)]
        rims: list[list[int]] = [[], []]
        for k, curve in enumerate(loop):
            after = (k + 1) % len(loop)
            solid = [replace(curve, points=lift(curve.points)) for lift in lifts]
            rim = [
                builder.add_edge(each[k], each[after], each_curve)
                for each, each_curve in zip(corners, solid, strict=True)
            ]
            for side in range(2):
                rims[side].append(rim[side])
            first, last = curve.domain
            if tall is None:
                surface, upper = (
                    write_sweep(*solid),
                    draw_line([first, 1], [last, 1], (first, last)),
                )
                v = [1.0, 1.0]
            else:
                lifted = lift_plane(tall, np.zeros(2))(curve.points)
                surface = write_sweep(solid[0], replace(curve, points=lifted))
                upper = graph_heights(curve, solid[1].points[:, 2] / tall)
                v = [float(solid[1].points[i, 2] / tall) for i in (0, -1)]
            builder.add_face(
                surface,
                [
                    [
                        (rim[0], False, draw_line([first, 0], [last, 0], (first, last))),
                        (posts[after], False, draw_line([last, 0], [last, v[1]])),
                        (rim[1], True, upper),
                        (posts[k], True, draw_line([first, 0], [first, v[0]])),
                    ]
                ],
            )
        for side in range(2):
            ends[side].append(
                [(edge, False, curve) for edge, curve in zip(rims[side], loop, strict=True)]
            )
    for side in range(2):
        builder.add_face(write_plane(low, high, lifts[side]), ends[side], is_reversed=side == 0)
    return builder.write(is_closed=True)


def graph_heights(curve: Spline, heights: Array) -> Spline:
    """The curve (t, v(t)) where v has these Bézier ordinates and the weights of a curve.

    The curve consists of Bézier spans: its inner knots occur as often as its degree. For a rational
    one, t times the weight has one degree more.
    """
    p, w = curve.degree, curve.weights
    breaks = np.unique(curve.knots)
    if np.ptp(w) == 0:
        share = np.arange(p) / p
        u = np.concatenate([a + (b - a) * share for a, b in pairwise(breaks)])
        points = np.column_stack([np.append(u, breaks[-1]), heights])
        return Spline(p, curve.knots, points, w)
    rows = []
    for k, (a, b) in enumerate(pairwise(breaks)):
        weights, values = w[k * p : k * p + p + 1], (w * heights)[k * p : k * p + p + 1]
        share = np.arange(p + 2) / (p + 1)
        padded = [np.concatenate([x, [0.0]]) for x in (weights, values)]
        before = [np.concatenate([[0.0], x]) for x in (weights, values)]
        elevated = [share * y + (1 - share) * x for x, y in zip(padded, before, strict=True)]
        moment = share * before[0] * b + (1 - share) * padded[0] * a
        rows.append(np.stack([moment, elevated[1], elevated[0]], axis=1))
    net = np.concatenate([*[each[:-1] for each in rows], rows[-1][-1:]])
    knots = np.concatenate([breaks[:1], np.repeat(breaks, p + 1), breaks[-1:]])
    points = net[:, :2] / net[:, 2:]
    # The first point of a span is the last of the one before; rounding may differ by an ulp.
    return Spline(p + 1, knots, points, net[:, 2])


def build_trimmed(surface: Document, loops: list[Loop]) -> Document:
    """A face that is trimmed by parameter curves alone."""
    face = {
        "name": "face",
        "surface": surface,
        "loops": [{"pcurves": [write_curve(curve) for curve in loop]} for loop in loops],
    }
    return {
        "type": "brep", "up": "y", "vertices": [], "edges": [], "faces": [face],
        "shells": [{"faces": [0], "closed": False}],
    }  # fmt: skip


def move_document(
    document: Document, move: Callable[[Array], Array], *, mirrored: bool
) -> Document:
    """The document with all points of space moved; a reflection reverses all faces."""
    moved = dict(document)
    if document["vertices"]:
        moved["vertices"] = move(np.array(document["vertices"])).tolist()
    moved["edges"] = [
        edge | {"curve": _move_points(edge["curve"], "control_points", move)}
        if "curve" in edge
        else edge
        for edge in document["edges"]
    ]
    moved["faces"] = [
        face
        | {"surface": _move_points(face["surface"], "control_net", move)}
        | {"reversed": bool(face.get("reversed")) != mirrored}
        for face in document["faces"]
    ]
    return moved


def _move_points(entry: Document, key: str, move: Callable[[Array], Array]) -> Document:
    points = np.array(entry[key])
    return entry | {key: move(points.reshape(-1, 3)).reshape(points.shape).tolist()}


def draw_move(rng: Random, *, far: bool, mirrored: bool) -> Callable[[Array], Array]:
    """A rotation and a shift, far from the origin with `far`; with `mirrored` a reflection too."""
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    if (np.linalg.det(turn) < 0) != mirrored:
        turn[:, 0] = -turn[:, 0]
    shift = rng.normal(size=3) * 10 ** (rng.uniform(2, 5) if far else 0.0)
    scale = 1.0 if far else 10 ** rng.uniform(-3, 3)
    return lambda points: scale * points @ turn.T + shift
