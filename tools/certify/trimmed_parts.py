"""Families of faces that are trimmed in parameters alone: tori, bands, caps and free forms."""

from dataclasses import replace

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
from tools.certify.part_documents import Document, Part, build_trimmed
from tools.certify.part_surfaces import draw_tolerance, draw_wave, draw_windows, revolve


def build_torus(rng: Random) -> Part:
    """A torus between two waves around it, or a patch of it, with windows; no edges are given."""
    radius = rng.uniform(0.05, 0.95)
    profile = draw_arc(np.array([1.0, 0]), np.array([radius, radius]), 0.0, 2 * np.pi)
    surface = revolve(profile)
    if rng.random() < 0.5:
        border = [[draw_wave(rng, 0.3, 0.9)], reverse_loop([draw_wave(rng, 2.2, 3.4)])]
    else:
        corners = np.array([[0.2, 0.3], [3.8, 0.3], [3.8, 3.4], [0.2, 3.4]])
        border = [draw_segments(corners)]
    windows = draw_windows(rng, np.array([0.3, 1.0]), np.array([3.7, 2.1]), int(rng.integers(0, 5)))
    return Part(build_trimmed(surface, border + windows), draw_tolerance(rng, 3e-4))


def build_around(rng: Random) -> Part:
    """A cone or a barrel between waves around it: one to three bands, with windows."""
    kind = rng.integers(3)
    radii = np.array([[1.0, 0], [1.0, 4]])
    if kind == 1:
        radii = np.array([[1.0, 0], [10 ** rng.uniform(-2, 1), 4]])
    profile = Spline(1, np.array([0.0, 0, 4, 4]), radii, np.ones(2))
    if kind == 2:
        points = np.column_stack([rng.uniform(0.5, 2, 5), np.linspace(0, 4, 5)])
        profile = Spline(3, np.array([0.0, 0, 0, 0, 2, 4, 4, 4, 4]), points, np.ones(5))
    loops: list[Loop] = []
    bands = int(rng.integers(1, 4))
    for k in range(bands):
        low, high = 4 * k / bands, 4 * (k + 1) / bands
        size = high - low
        loops.append([draw_wave(rng, low + 0.02 * size, low + 0.2 * size)])
        loops.append(reverse_loop([draw_wave(rng, high - 0.3 * size, high - 0.02 * size)]))
        if rng.random() < 0.5:
            corners = np.array([0.1, low + 0.25 * size]), np.array([3.9, low + 0.65 * size])
            loops += draw_windows(rng, *corners, int(rng.integers(1, 4)))
    return Part(build_trimmed(revolve(profile), loops), draw_tolerance(rng, 1e-4))


def build_cap(rng: Random) -> Part:
    """A part of a sphere around a pole, above or below a wave, without an edge at the pole."""
    profile = draw_arc(np.zeros(2), np.ones(2), -np.pi / 2, np.pi / 2)
    points = profile.points.copy()
    points[[0, -1], 0] = 0.0
    surface = revolve(replace(profile, points=points))
    if rng.random() < 0.5:
        loops = [[draw_wave(rng, 0.5, 1.2)]]
        low, high = np.array([0.1, 1.25]), np.array([3.9, 1.8])
    else:
        loops = [reverse_loop([draw_wave(rng, 0.8, 1.5)])]
        low, high = np.array([0.1, 0.2]), np.array([3.9, 0.75])
    loops += draw_windows(rng, low, high, int(rng.integers(0, 4)))
    return Part(build_trimmed(surface, loops), draw_tolerance(rng, 3e-4))


def build_freeform(rng: Random) -> Part:
    """A wavy B-spline surface, with kinks in some, trimmed by curves in parameters alone."""
    p, q = (int(x) for x in rng.integers(1, 6, 2))
    counts = p + int(rng.integers(1, 5)), q + int(rng.integers(1, 5))
    x, y = np.meshgrid(*(np.linspace(0, 1, n) for n in counts), indexing="ij")
    z = 10 ** rng.uniform(-3, -0.5) * rng.normal(size=counts)
    knots = []
    for degree, count in zip((p, q), counts, strict=True):
        inner = np.sort(rng.uniform(0.1, 0.9, count - degree - 1))
        if degree > 1 and len(inner) > 1 and rng.random() < 0.3:
            inner[: min(degree, len(inner))] = 0.5
            inner.sort()
        knots.append(np.concatenate([[0.0] * (degree + 1), inner, [1.0] * (degree + 1)]))
    surface: Document = {
        "type": "bspline", "degree": [p, q], "knots": [k.tolist() for k in knots],
        "control_net": np.stack([x, y, z], axis=2).tolist(),
    }  # fmt: skip
    if rng.random() < 0.4:
        surface["weights"] = (10 ** rng.uniform(-0.5, 0.5, counts)).tolist()
    plate = draw_plate(rng, holes=int(rng.integers(1, 4)), nearest=1e-6)
    size = plate[0][0].points.max()
    size = max(float(c.points.max()) for c in plate[0])
    margin = float(rng.choice([0.0, 0.01]))
    scaled = [
        [replace(c, points=margin + c.points * ((1 - 2 * margin) / size)) for c in loop]
        for loop in plate
    ]
    return Part(build_trimmed(surface, scaled), draw_tolerance(rng, 1e-4))
