"""Families of generated parts: `make certify` and its tests judge them.

A family builds a part from a seed. Tolerances are from 1e-6 to 10 diagonals.
"""

from collections.abc import Callable
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from tools.certify import part_documents as documents
from tools.certify.more_parts import (
    build_bare,
    build_crossed,
    build_crowded,
    build_crumbs,
    build_hollow,
    build_sieve,
)
from tools.certify.part_curves import (
    WIDE_KINDS,
    Random,
    draw_plate,
    draw_segments,
    draw_shape,
    reverse_loop,
)
from tools.certify.part_documents import Document, Part, build_prism
from tools.certify.part_surfaces import draw_tolerance
from tools.certify.trimmed_parts import build_around, build_cap, build_freeform, build_torus


class PartFamily(NamedTuple):
    """A family of parts: how many `make certify` judges, and the function of a generator."""

    size: int
    build: Callable[[Random], Part]


def build_part(name: str, seed: int) -> Part:
    """The part of a family with this seed."""
    number = list(PARTS).index(name)
    part = PARTS[name].build(np.random.default_rng([seed, number, 35]))
    return part


def build_plate(rng: Random) -> Part:
    """A prism with holes of every shape, 1e-6 of a cell to 0.1 from borders and each other."""
    loops = draw_plate(rng, holes=int(rng.integers(1, 4)), nearest=1e-6)
    slope = rng.uniform(-0.1, 0.1, 2) * rng.integers(0, 2)
    document = build_prism(loops, 1.0, slope)
    return Part(document, draw_tolerance(rng, 1e-5), is_closed=True)


def build_sheet(rng: Random) -> Part:
    """One plane face with holes, without parameter curves."""
    loops = draw_plate(rng, holes=int(rng.integers(1, 4)), nearest=1e-5)
    solid = build_prism(loops, 1.0, np.zeros(2))
    truth = _take_face(solid, -1)
    document = _take_face(solid, -1)
    for loop in document["faces"][0]["loops"]:
        del loop["pcurves"]
    return Part(document, draw_tolerance(rng, 1e-6), truth)


def _take_face(document: Document, number: int) -> Document:
    """A face of a document alone, with its edges and vertices."""
    face = document["faces"][number]
    used = sorted({edge for loop in face["loops"] for edge in loop["edges"]})
    edges = [document["edges"][k] for k in used]
    corners = sorted({k for edge in edges for k in edge["vertices"]})
    loops = [loop | {"edges": [used.index(k) for k in loop["edges"]]} for loop in face["loops"]]
    return document | {
        "vertices": [document["vertices"][k] for k in corners],
        "edges": [
            edge | {"vertices": [corners.index(k) for k in edge["vertices"]]} for edge in edges
        ],
        "faces": [face | {"loops": loops}],
        "shells": [{"faces": [0], "closed": False}],
    }


def build_cut_cylinder(rng: Random) -> Part:
    """A cylinder of round or other section that a plane cuts: its sides are trimmed."""
    return _cut_cylinder(rng, str(rng.choice(["circle", "arcs", "ellipse", "smooth", "slot"])))


def _cut_cylinder(rng: Random, kind: str) -> Part:
    radius = 10 ** rng.uniform(-1, 1)
    loops = [draw_shape(rng, kind, rng.uniform(-2, 2, 2), radius)]
    if rng.random() < 0.4 and kind in ("circle", "arcs"):
        middle = np.concatenate([c.points for c in loops[0]]).mean(axis=0)
        hole = draw_shape(rng, "circle", middle, 0.3 * radius)
        loops.append(reverse_loop(hole))
    slope = rng.normal(size=2) * 10 ** rng.uniform(-3, 0.5)
    heights = np.concatenate([c.points for loop in loops for c in loop]) @ slope
    height = radius * rng.uniform(0.01, 3) - heights.min()
    tall = float((height + heights.max()) * rng.uniform(1, 1.5))
    return Part(
        build_prism(loops, float(height), slope, tall=tall), draw_tolerance(rng, 1e-5),
        is_closed=True,
    )  # fmt: skip


def build_thin(rng: Random) -> Part:
    """A prism with faces 1e-6 wide: a thin plate, a narrow strip, a needle, a wedge."""
    kind, width = int(rng.integers(4)), 10 ** rng.uniform(-6, -3)
    if kind == 0:
        loops = draw_plate(rng, holes=1, nearest=1e-3)
        return Part(
            build_prism(loops, width, np.zeros(2)), draw_tolerance(rng, 1e-5), is_closed=True
        )
    corners = np.array([[0.0, 0], [1, 0], [1, width], [0, width]])
    if kind == 2:
        corners = np.array([[0.0, 0], [1, 0], [0, width]])
    if kind == 3:
        a, b = 0.5 - width / 2, 0.5 + width / 2
        corners = np.array([[0.0, 0], [1, 0], [1, 1], [b, 1], [b, 0.1], [a, 0.1], [a, 1], [0, 1]])
    turn = rng.uniform(0, 2 * np.pi)
    corners = corners @ np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
    document = build_prism([draw_segments(corners)], 10 ** rng.uniform(-1, 0), np.zeros(2))
    return Part(document, draw_tolerance(rng, 1e-6), is_closed=True)


def build_gappy(rng: Random) -> Part:
    """A prism or cut cylinder whose edges are off its faces by up to the tolerance."""
    part = _cut_cylinder(rng, "arcs") if rng.random() < 0.5 else build_plate_apart(rng)
    relative = max(part.relative, 1e-4)
    points = np.array(part.document["vertices"])
    diagonal = float(np.linalg.norm(np.ptp(points, axis=0)))
    gap = min(relative, 0.002) * diagonal * rng.uniform(0.01, 1) / 2
    document = part.document | {"edges": [dict(edge) for edge in part.document["edges"]]}
    for edge in document["edges"]:
        if "curve" in edge:
            net = np.array(edge["curve"]["control_points"])
            # The ends stay at their vertices, and the middle is moved furthest.
            rise = np.sin(np.pi * np.arange(len(net)) / (len(net) - 1))
            net += gap * rise[:, np.newaxis] * rng.uniform(-1, 1, 3) / np.sqrt(3)
            edge["curve"] = edge["curve"] | {"control_points": net.tolist()}
    if rng.random() < 0.5:
        document["uncertainty"] = 2 * gap
    return Part(document, relative, part.document, part.is_closed, slack=gap)


def build_plate_apart(rng: Random) -> Part:
    """A prism with holes at least 0.05 of a cell from borders and each other."""
    loops = draw_plate(rng, holes=int(rng.integers(1, 4)), nearest=0.05, kinds=WIDE_KINDS)
    return Part(build_prism(loops, 1.0, np.zeros(2)), draw_tolerance(rng, 1e-4), is_closed=True)


def build_wrong(rng: Random) -> Part:
    """A cut cylinder or plate of whose parameter curves some are wrong or missing."""
    part = build_cut_cylinder(rng) if rng.random() < 0.7 else build_plate(rng)
    document: Any = part.document | {"faces": [dict(face) for face in part.document["faces"]]}
    for face in document["faces"]:
        face["loops"] = [dict(loop) for loop in face["loops"]]
        for loop in face["loops"]:
            loop["pcurves"] = [_spoil(rng, curve) for curve in loop["pcurves"]]
    return Part(document, part.relative, part.document, is_closed=True, slack=1e-6)


def _spoil(rng: Random, curve: Document) -> Document | None:
    """A parameter curve that is missing, moved, bent or reversed; often a good one."""
    kind = int(rng.integers(6))
    net = np.array(curve["control_points"])
    size = float(np.ptp(net, axis=0).max())
    if kind == 0:
        return None
    if kind == 1:
        net = net + 1e-3 * size * rng.uniform(-1, 1, net.shape)
    if kind == 2:
        net = net + 10 ** rng.uniform(-6, -2) * size * rng.uniform(-1, 1, 2)
    if kind == 3:
        knots = np.array(curve["knots"])
        share = (knots - knots[0]) / (knots[-1] - knots[0])
        return curve | {"knots": (share * (1 + 0.2 * share)).tolist()}
    return curve | {"control_points": net.tolist()}


def build_moved(rng: Random) -> Part:
    """A part of another family, rotated and in half of the cases mirrored; near or far."""
    builders = build_plate, build_cut_cylinder, build_torus, build_freeform, build_around
    part = builders[int(rng.integers(len(builders)))](rng)
    mirrored = bool(rng.integers(2))
    far = bool(rng.integers(2))
    move = documents.draw_move(rng, far=far, mirrored=mirrored)
    moved = documents.move_document(part.document, move, mirrored=mirrored)
    relative = max(part.relative, 1e-4) if far else part.relative
    return Part(moved, relative, None, part.is_closed)


def build_coarse(rng: Random) -> Part:
    """A small part at the tolerance of a large assembly."""
    builders = build_plate, build_cut_cylinder, build_torus, build_around, build_cap, build_thin
    part = builders[int(rng.integers(len(builders)))](rng)
    return replace(part, relative=float(10 ** rng.uniform(-1, 1)))


PARTS = {
    "plates": PartFamily(140, build_plate),
    "sheets": PartFamily(100, build_sheet),
    "cut cylinders": PartFamily(140, build_cut_cylinder),
    "thin parts": PartFamily(80, build_thin),
    "trimmed tori": PartFamily(80, build_torus),
    "bands around": PartFamily(100, build_around),
    "caps": PartFamily(80, build_cap),
    "trimmed freeform": PartFamily(100, build_freeform),
    "gaps": PartFamily(80, build_gappy),
    "wrong curves": PartFamily(100, build_wrong),
    "moved parts": PartFamily(80, build_moved),
    "small parts": PartFamily(60, build_coarse),
    "many holes": PartFamily(20, build_sieve),
    "voids": PartFamily(30, build_hollow),
    "edges of 1e-9": PartFamily(60, build_crumbs),
    "close knots": PartFamily(60, build_crowded),
    "no loops": PartFamily(40, build_bare),
    "across the seam": PartFamily(40, build_crossed),
}
"""The families by name."""
