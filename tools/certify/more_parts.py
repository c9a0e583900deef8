"""Further families of generated parts: many holes, voids, edges of 1e-9, close knots, no loops."""

from dataclasses import replace
from itertools import pairwise

import numpy as np

from oracles.brep_documents import Spline
from tools.certify.part_curves import (
    Loop,
    Random,
    draw_arc,
    draw_plate,
    draw_segments,
    reverse_loop,
)
from tools.certify.part_documents import (
    Document,
    Part,
    build_prism,
    build_trimmed,
    draw_line,
    move_document,
)
from tools.certify.part_surfaces import draw_tolerance, draw_wave, revolve


def build_sieve(rng: Random) -> Part:
    """A prism with up to 100 holes."""
    loops = draw_plate(rng, holes=int(rng.integers(5, 11)), nearest=1e-4)
    return Part(build_prism(loops, 0.3, np.zeros(2)), draw_tolerance(rng, 1e-4), is_closed=True)


def build_hollow(rng: Random) -> Part:
    """A prism with one or two voids, which are prisms too."""
    square = np.array([[0.0, 0], [1, 0], [1, 1], [0, 1]])
    outside = build_prism([draw_segments(square)], 1.0, np.zeros(2))
    shift = [np.array([0.02, 0.02]), np.array([0.7, 0.75])]
    document = outside
    for k in range(int(rng.integers(1, 3))):
        size = rng.uniform(0.01, 0.2)
        loops = draw_plate(rng, holes=1, nearest=0.01)
        scaled = [[replace(c, points=shift[k] + size * c.points) for c in loop] for loop in loops]
        inside = build_prism(scaled, 0.5, np.zeros(2))
        document = join_void(document, _lift(inside, 0.25))
    return Part(document, draw_tolerance(rng, 1e-5), is_closed=True)


def _lift(document: Document, height: float) -> Document:
    up = np.array([0, 0, height])
    return move_document(document, lambda points: points + up, mirrored=False)


def join_void(document: Document, void: Document) -> Document:
    """The document with another one as its void: its faces are reversed."""
    vertices, edges, faces = (len(document[key]) for key in ("vertices", "edges", "faces"))
    moved_edges = [
        edge | {"vertices": [k + vertices for k in edge["vertices"]]} for edge in void["edges"]
    ]
    moved_faces = [
        face
        | {"reversed": not face["reversed"]}
        | {"loops": [x | {"edges": [k + edges for k in x["edges"]]} for x in face["loops"]]}
        for face in void["faces"]
    ]
    shell = {"faces": [k + faces for k in range(len(void["faces"]))], "closed": True}
    return document | {
        "vertices": document["vertices"] + void["vertices"],
        "edges": document["edges"] + moved_edges,
        "faces": document["faces"] + moved_faces,
        "shells": [*document["shells"], shell],
    }


def build_crumbs(rng: Random) -> Part:
    """A prism some of whose edges are 1e-9 to 1e-4 long; their uncertainty is of that size."""
    loops = draw_plate(rng, holes=int(rng.integers(1, 3)), nearest=0.05)
    crumbled: list[Loop] = []
    for loop in loops:
        pieces: Loop = []
        for curve in loop:
            if curve.degree > 1:
                pieces.append(curve)
                continue
            (a, b), count = curve.points, int(rng.integers(0, 4))
            length = float(np.hypot(*(b - a)))
            steps = 10 ** rng.uniform(-9, -4, count) / length
            shares = np.concatenate([[0.0], np.cumsum(steps), [1.0]])
            points = a + shares[:, np.newaxis] * (b - a)
            points[-1] = b
            pieces += [draw_line(p, q) for p, q in pairwise(points)]
        crumbled.append(pieces)
    document = build_prism(crumbled, 1.0, np.zeros(2))
    uncertainty = 10 ** rng.uniform(-8, -4)
    document["edges"] = [edge | {"uncertainty": uncertainty} for edge in document["edges"]]
    return Part(document, draw_tolerance(rng, 1e-5), is_closed=True)


def build_crowded(rng: Random) -> Part:
    """A wavy surface whose knots are 1e-9 to 1e-3 apart, trimmed in parameters alone."""
    p, q = (int(x) for x in rng.integers(2, 5, 2))
    counts = p + 5, q + 5
    knots = []
    for degree in (p, q):
        middle, step = rng.uniform(0.2, 0.8), 10 ** rng.uniform(-9, -3)
        inner = np.sort(np.append(middle + step * np.arange(3), rng.uniform(0.05, 0.95)))
        knots.append(np.concatenate([[0.0] * (degree + 1), inner, [1.0] * (degree + 1)]))
    # Points above the Greville abscissae, so that the surface does not fold where knots are close.
    x, y = (
        np.array([k[i + 1 : i + 1 + d].mean() for i in range(n)])
        for k, d, n in zip(knots, (p, q), counts, strict=True)
    )
    height = rng.uniform(0.01, 0.3)
    z = height * np.sin(rng.uniform(2, 9) * x)[:, np.newaxis] * np.cos(rng.uniform(2, 9) * y)
    net = np.stack([*np.meshgrid(x, y, indexing="ij"), z], axis=2)
    surface: Document = {
        "type": "bspline", "degree": [p, q], "knots": [k.tolist() for k in knots],
        "control_net": net.tolist(),
    }  # fmt: skip
    holes = int(rng.integers(1, 4))
    loops = [
        [replace(c, points=0.01 + 0.98 * c.points / holes) for c in loop]
        for loop in draw_plate(rng, holes=holes, nearest=1e-4)
    ]
    return Part(build_trimmed(surface, loops), draw_tolerance(rng, 3e-4))


def build_bare(rng: Random) -> Part:
    """A surface without loops: a ball, a spindle, a ring, a barrel, a sheet; two are closed."""
    kind = int(rng.integers(5))
    if kind == 0:
        profile = draw_arc(np.zeros(2), np.ones(2), -np.pi / 2, np.pi / 2)
        points = profile.points.copy()
        points[[0, -1], 0] = 0.0
        surface = revolve(replace(profile, points=points))
    elif kind == 1:
        points = np.column_stack([rng.uniform(0.2, 2, 6), np.linspace(0, 4, 6)])
        points[[0, -1], 0] = 0.0
        surface = revolve(Spline(3, np.array([0.0] * 4 + [1, 2] + [3] * 4), points, np.ones(6)))
    elif kind == 2:
        radius = rng.uniform(0.05, 0.95)
        profile = draw_arc(np.array([1.0, 0]), np.array([radius, radius]), 0.0, 2 * np.pi)
        surface = revolve(profile)
    elif kind == 3:
        points = np.column_stack([rng.uniform(0.2, 2, 6), np.linspace(0, 4, 6)])
        surface = revolve(Spline(3, np.array([0.0] * 4 + [1, 2] + [3] * 4), points, np.ones(6)))
    else:
        x, y = np.meshgrid(np.linspace(0, 1, 6), np.linspace(0, 1, 5), indexing="ij")
        net = np.stack([x, y, 0.2 * rng.normal(size=x.shape)], axis=2)
        surface = {
            "type": "bspline", "degree": [3, 2], "knots": "clamped", "control_net": net.tolist(),
        }  # fmt: skip
    document = build_trimmed(surface, [])
    return Part(document, draw_tolerance(rng, 1e-4), is_closed=kind < 3)


def build_crossed(rng: Random) -> Part:
    """A cylinder whose borders cross its seam, with a window over the seam."""
    profile = Spline(1, np.array([0.0, 0, 4, 4]), np.array([[1.0, 0], [1.0, 4]]), np.ones(2))
    shift = float(rng.uniform(0.1, 3.9))
    loops: list[Loop] = [[draw_wave(rng, 0.1, 0.8)], [draw_wave(rng, 3.0, 3.9)]]
    aside = np.array([shift, 0.0])
    moved = [[replace(c, points=c.points + aside) for c in loop] for loop in loops]
    moved[1] = reverse_loop(moved[1])
    window = np.array([[3.6, 1.2], [4.4, 1.2], [4.4, 2.6], [3.6, 2.6]])
    moved.append(reverse_loop(draw_segments(window)))
    return Part(build_trimmed(revolve(profile), moved), draw_tolerance(rng, 1e-4))
