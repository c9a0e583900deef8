"""Measures of parts: closed forms, values of Open CASCADE, placed copies, borders and gaps."""

from copy import deepcopy
from itertools import pairwise
from math import pi, sqrt
from typing import Any

import numpy as np
import pytest
from hypothesis import given

from oracles.brep_documents import read_curve
from oracles.brep_partials import evaluate_curve
from oracles.solids import read_solid
from service.engine.measures.joined_surface import RequestSide
from service.engine.measures.values import (
    BudgetEnded,
    FaceEdge,
    Interval,
    MeasureQuery,
    Measures,
)
from service.engine.parts.measures.measure import measure_part
from tests.breps import PLATE, build_box
from tests.engine.brep.solid_documents import lower
from tests.engine.brep.test_inside import build_apart
from tests.engine.parts.test_part import MIRROR, SADDLE, lower_group
from tests.engine.trims.tables import seeds
from tests.engine.trims.test_inside import draw_star, make_circle, make_face, make_polygon

Document = dict[str, Any]

CLOSED_FORMS = {
    "cone": (36 * pi + 6 * pi * sqrt(136), 120 * pi),
    "cylinder": (170 * pi, 300 * pi),
    "steinmetz": (24 * (2 - sqrt(2)) * 64, 8 * (2 - sqrt(2)) * 512),
    "torus": (4 * pi * pi * 30, 2 * pi * pi * 90),
    # A cylinder through the middle of a sphere whose diameter is the radius: Viviani's body.
    "viviani": (200 * pi, 2 / 3 * 1000 * (pi - 4 / 3)),
}
"""Areas and volumes."""

OPEN_CASCADE = {
    "gear": (1136.586339264255, 1109.4870858271609),
    "loft": (859.1064909916238, 1195.8621125578843),
}
"""Areas and volumes by Open CASCADE 8.0 (`SurfaceProperties` and `VolumePropertiesGK` to 1e-9)."""


def measure(document: Document, tolerance: float = 1e-6) -> Measures[RequestSide | FaceEdge]:
    return measure_part(lower(document), MeasureQuery(tolerance))


def holds(interval: Interval | None, value: float, relative: float = 0.0) -> bool:
    assert interval is not None
    slack = relative * abs(value)
    return interval.low - slack <= value <= interval.high + slack


def get_volume(measures: Measures[RequestSide | FaceEdge]) -> Interval:
    assert measures.volume is not None
    return measures.volume


@pytest.mark.slow
@pytest.mark.parametrize("name", [*CLOSED_FORMS, *OPEN_CASCADE])
def test_intervals_hold_the_values_of_solids(name: str) -> None:
    measures = measure(read_solid(name))
    area, volume = (CLOSED_FORMS | OPEN_CASCADE)[name]
    slack = 1e-8 if name in OPEN_CASCADE else 1e-15
    if name == "steinmetz":  # its edges are splines that were fitted to 1e-9
        slack = 1e-9
    assert holds(measures.area, area, slack)
    assert holds(measures.volume, volume, slack)
    assert measures.reached
    assert measures.closed
    assert measures.area.is_within(1e-6 * area)


@given(seeds)
def test_areas_of_plane_faces_are_those_of_their_curves(seed: int) -> None:
    """The area within a curve is ½ ∮ x dy − y dx; faces may be transposed or reversed."""
    rng = np.random.default_rng(seed)
    star = draw_star(rng, np.array([0.5, 0.5]), 0.4)
    hole = make_circle((0.5, 0.5), 0.02)
    hole["pcurves"] = hole["pcurves"][::-1]
    hole["reversed"] = [True]
    expected = integrate(star) - pi * 4e-4
    document = make_face(star, hole)
    assert holds(measure(document).area, expected, 1e-13)
    turned = transpose(document["faces"][0]) | {"reversed": True}
    assert holds(measure(document | {"faces": [turned]}).area, expected, 1e-13)


def integrate(loop: Document) -> float:
    """½ ∮ x dy − y dx along the curves of a loop, by the rule of Gauss between their knots."""
    nodes, weights = np.polynomial.legendre.leggauss(60)
    total = 0.0
    for document in loop["pcurves"]:
        curve = read_curve(document)
        for low, high in pairwise(np.unique(curve.knots).tolist()):
            half = (high - low) / 2
            points, rates = evaluate_curve(curve, low + half * (1 + nodes))
            across = points[:, 0] * rates[:, 1] - points[:, 1] * rates[:, 0]
            total += half * float((weights * across).sum()) / 2
    return total


def transpose(face: Document) -> Document:
    """The face with u and v exchanged, and its loops in the other direction."""
    surface = face["surface"]
    net = np.array(surface["control_net"]).swapaxes(0, 1).tolist()
    loops = []
    for loop in face["loops"]:
        pcurves = [
            curve | {"control_points": [point[::-1] for point in curve["control_points"]]}
            for curve in reversed(loop["pcurves"])
        ]
        flags = loop.get("reversed", [False] * len(pcurves))
        loops.append({"pcurves": pcurves, "reversed": [not flag for flag in reversed(flags)]})
    knots = surface["knots"][::-1]
    return face | {"surface": surface | {"control_net": net, "knots": knots}, "loops": loops}


def test_a_hole_without_a_pcurve_and_its_edges() -> None:
    measures = measure(PLATE)
    assert holds(measures.area, 100 - 4 * pi, 1e-15)
    assert measures.volume is None
    assert not measures.closed
    assert measures.edge_lengths is not None
    assert all(
        holds(length, value, 1e-15)
        for length, value in zip(measures.edge_lengths, [10.0] * 4 + [4 * pi], strict=True)
    )
    assert holds(measures.boundary_length, 40 + 4 * pi, 1e-15)
    assert [(each.edges, each.closed) for each in measures.boundaries] == [(4, True), (1, True)]
    assert [each.first for each in measures.boundaries] == [FaceEdge(0, 0), FaceEdge(0, 4)]
    assert (measures.open_edges, measures.inconsistent_edges) == (5, 0)


@given(seeds)
def test_a_face_that_is_cut_by_an_edge_has_the_same_area(seed: int) -> None:
    """A part of a bicubic surface with many spans, in one piece and in two."""
    rng = np.random.default_rng(seed)
    whole = measure(cut_hills(rng, None))
    rng = np.random.default_rng(seed)
    cut = measure(cut_hills(rng, 1 + 2 * float(np.random.default_rng(seed).random())))
    assert whole.area.low <= cut.area.high
    assert cut.area.low <= whole.area.high


def cut_hills(rng: np.random.Generator, middle: float | None) -> Document:
    """A square of a hilly surface; its domain is [0, 5] × [0, 4]. It is
    cut along u = `middle`, if that is not None."""
    seed = np.random.default_rng(7)
    x, y = np.meshgrid(np.linspace(0, 1, 8), np.linspace(0, 1, 7), indexing="ij")
    net = np.stack([x, y, 0.1 * seed.normal(size=x.shape)], axis=-1)
    surface = {"type": "bspline", "degree": [3, 3], "control_net": net.tolist()}
    low, high = rng.random(2), 3 + rng.random(2)
    cuts = [low[0], high[0]] if middle is None else [low[0], middle, high[0]]
    faces = []
    for first, last in pairwise(cuts):
        box = [[first, low[1]], [last, low[1]], [last, high[1]], [first, high[1]], [first, low[1]]]
        faces.append({"surface": surface, "loops": [make_polygon(box)]})
    return {"type": "brep", "vertices": [], "edges": [], "faces": faces}


def test_copies_are_placed() -> None:
    """Copies that are turned, mirrored and scaled alike, one that is stretched, and a patch."""
    box = build_box() | {"up": "z"}
    stretch = np.diag([1.0, 3, -2, 1])
    stretch[:3, 3] = 5, 6, 7
    members = [{"surface": box, "matrix": matrix.tolist()} for matrix in (MIRROR, stretch)]
    model = lower_group({"surface": box, "name": "box"}, *members)
    measures = measure_part(model, MeasureQuery())
    areas, volumes = [52.0, 4 * 52.0, 212.0], [24.0, 8 * 24.0, 6 * 24.0]
    middles = np.array([[1, 1.5, 2, 1]]).T
    centers = [middles[:3, 0], *((matrix @ middles)[:3, 0] for matrix in (MIRROR, stretch))]
    for part, area, volume, center in zip(measures.parts, areas, volumes, centers, strict=True):
        assert holds(part.area, area, 1e-15)
        assert holds(part.volume, volume, 1e-15)
        assert part.centroid is not None
        assert all(holds(x, value, 1e-15) for x, value in zip(part.centroid, center, strict=True))
    assert holds(measures.area, sum(areas), 1e-15)
    assert holds(measures.volume, sum(volumes), 1e-15)
    center = np.average(centers, axis=0, weights=volumes)
    assert measures.centroid is not None
    assert all(holds(x, value) for x, value in zip(measures.centroid, center, strict=True))
    assert measures.reached
    assert measures.edge_lengths is not None
    assert len(measures.edge_lengths) == 36
    assert holds(Interval.total(measures.edge_lengths[24:]), 4 * (2 + 9 + 8), 1e-15)
    with_patch = measure_part(lower_group({"surface": SADDLE}, {"surface": box}), MeasureQuery())
    assert with_patch.volume is None
    assert [part.volume is None for part in with_patch.parts] == [True, False]
    assert holds(with_patch.boundary_length, 4 * sqrt(2), 1e-15)


def test_open_and_inconsistent_edges_are_numbered_in_the_request() -> None:
    box = build_box()
    open_box = deepcopy(box)
    open_box["faces"].pop()
    open_box["shells"] = [{"faces": list(range(5)), "closed": False}]
    turned = deepcopy(box)
    turned["faces"][5]["reversed"] = True
    turned["shells"] = [{"faces": list(range(5)), "closed": False}, {"faces": [5], "closed": False}]
    model = lower_group({"surface": box}, {"surface": open_box}, {"surface": turned})
    measures = measure_part(model, MeasureQuery())
    assert [part.volume is None for part in measures.parts] == [False, True, True]
    assert (measures.open_edges, measures.inconsistent_edges) == (12, 0)
    edges = [each.request_side for each in measures.faulty_edges]
    assert all(each.is_open for each in measures.faulty_edges)
    # The fifth face of the second box is opposite to the missing one.
    lost = box["faces"][5]["loops"][0]["edges"]
    expected = [
        FaceEdge(6 + face, 12 + edge)
        for face in range(5)
        for edge in box["faces"][face]["loops"][0]["edges"]
        if edge in lost
    ]
    assert edges[:4] == expected
    assert measures.boundary_count == 3
    assert holds(measures.boundary_length, 3 * 14, 1e-15)


def test_a_face_that_is_left_out_leaves_the_part_open() -> None:
    box = build_box() | {"invalid_faces": "skip"}
    box["faces"][3]["loops"][0] = {"edges": [0, 1, 2]}
    measures = measure(box)
    assert not measures.closed
    assert measures.volume is None
    assert measures.skipped_faces is not None
    assert [each.face for each in measures.skipped_faces] == [3]


@pytest.mark.parametrize("gap", [0.02, -0.02])
def test_volumes_hold_every_closing_of_gaps(gap: float) -> None:
    """A box whose edges are off its faces has the volume of these faces, or that of its edges."""
    box = build_box((2, 3, 4))
    vertices = np.array(box["vertices"])
    middle = vertices.mean(axis=0)
    box["vertices"] = (middle + (vertices - middle) * (1 + gap)).tolist()
    box["uncertainty"] = 0.2
    corners = [[0, 0], [1, 0], [1, 1], [0, 1], [0, 0]]
    pcurves = make_polygon(corners)["pcurves"]
    for face in box["faces"]:
        loop = face["loops"][0]
        loop["pcurves"] = [
            curve | {"control_points": curve["control_points"][:: -1 if flag else 1]}
            for curve, flag in zip(pcurves, loop["reversed"], strict=True)
        ]
    measures = measure(box)
    assert measures.closed
    assert not measures.reached
    assert measures.gap_bound is not None
    assert abs(gap) <= measures.gap_bound <= 4 * abs(gap)
    assert holds(measures.volume, 24)
    assert holds(measures.volume, 24 * (1 + gap) ** 3)
    assert get_volume(measures).is_within(0.5 * 24)
    assert holds(measures.area, 52, 1e-15)


@pytest.mark.parametrize("gap", [0.01, 1e-6])
def test_an_area_is_that_of_the_parameter_curves(gap: float) -> None:
    measures = measure(build_apart(gap))
    assert holds(measures.area, 100, 1e-14)
    assert holds(measures.boundary_length, 40 - 2 * gap, 1e-14)


def test_a_trial_ends_and_a_small_budget_gives_wider_intervals() -> None:
    model = lower(read_solid("cone"))
    with pytest.raises(BudgetEnded):
        measure_part(model, MeasureQuery(1e-6, budget=100, is_trial=True))
    wide = measure_part(model, MeasureQuery(1e-9, budget=2000))
    narrow = measure_part(model, MeasureQuery(1e-9))
    assert not wide.reached
    assert wide.area.low < narrow.area.low < narrow.area.high < wide.area.high
