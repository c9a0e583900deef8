"""Judges `/v1/project` on parts: closest points, their intervals, and signs.

`wrong`: the judge found a point of the part nearer than the interval allows; or the reported point
is not on the part, or its distance is another; or a sign is not that of the closed form, or of the
hits that the judge counts. `wider`: intervals wider than asked for, which `reached` admits. `null`:
signs that are not decided. `judged`: signs that the judge knows. `far`: points for which the judge
found none as near as the service, of which it cannot say more. `width`: the largest width of an
interval, in units of the width that the question asks for.
"""

from collections import Counter
from typing import Any

import numpy as np

from oracles.brep_documents import Array
from oracles.parts import INSIDE, OUTSIDE, UNSURE, list_poles
from tools.judge.findings import Findings
from tools.judge.judged_part import FORM, ON_PART, ROUNDING, JudgedPart

TOLERANCE = 1e-9
"""The width of intervals that is asked for, relative to the diagonal."""

NEAR_POLE = 1e-3
"""Share of the diagonal: signs of points that are nearer to a pole are not judged by rays."""

SIGN_DIRECTIONS = 3
"""The number of rays from a point whose hits the judge counts."""


def judge_closest(judged: JudgedPart, count: int, seed: int) -> Findings:
    """The findings about `count` points."""
    rng = np.random.default_rng([seed, 2])
    points = scatter_points(judged, count, rng)
    wants_signs = judged.case.is_closed
    answer = judged.ask("project", points=points.tolist(), sign=wants_signs)
    findings = Findings(judged.case.name, seed)
    compare_distances(judged, points, answer, findings)
    check_places(judged, points, answer, findings)
    if wants_signs:
        compare_signs(judged, points, answer, findings)
    findings.counts["points"] = len(points)
    return findings


def scatter_points(judged: JudgedPart, count: int, rng: np.random.Generator) -> Array:
    """Points (count, 3): in the box, beside it, far away, on the part, on its edges, close to both,
    and midway between two of its points."""
    low, high = judged.part.corners
    reach = judged.search.diagonal
    samples, edges = judged.list_samples()
    first, second, third = (samples[rng.integers(0, len(samples), count)] for _ in range(3))
    edge = edges[rng.integers(0, len(edges), count)]
    close = reach * 10 ** rng.uniform(-10, -1, (count, 1)) * _draw_directions(rng, count)
    kinds = [
        rng.uniform(low, high, (count, 3)),
        rng.uniform(low - 0.3 * reach, high + 0.3 * reach, (count, 3)),
        (low + high) / 2 + 5 * reach * _draw_directions(rng, count),
        first,
        first + close,
        edge,
        edge + close,
        (second + third) / 2,
    ]
    kind = rng.choice(len(kinds), count, p=[0.3, 0.12, 0.05, 0.05, 0.2, 0.03, 0.15, 0.1])
    return np.asarray(np.stack(kinds)[kind, np.arange(count)])


def _draw_directions(rng: np.random.Generator, count: int) -> Array:
    directions = rng.normal(size=(count, 3))
    return np.asarray(directions / np.linalg.norm(directions, axis=1, keepdims=True))


def compare_distances(judged: JudgedPart, points: Array, answer: Any, findings: Findings) -> None:
    """Compares distances and intervals with the nearest points that the judge finds."""
    form, size = judged.case.form, judged.size
    bounds, distances = np.array(answer["distance_bounds"]), np.array(answer["distances"])
    reached = np.array(answer["reached"])
    found = judged.find_nearest(points)
    slack = ROUNDING * (np.abs(points).max(axis=1) + size)
    known = found
    if form is not None:
        known = np.abs(form.measure(points))
        slack = slack + FORM * (size + known)
        is_outside = (known < bounds[:, 0] - slack) | (known > bounds[:, 1] + slack)
    else:
        is_outside = found < bounds[:, 0] - slack
    is_outside |= ~(bounds[:, 0] <= bounds[:, 1]) | ~(distances <= bounds[:, 1])
    findings.add(
        "interval of point", is_outside,
        lambda n: f"{points[n].tolist()}: {bounds[n].tolist()}, judge {known[n]!r}",
    )  # fmt: skip
    width = bounds[:, 1] - bounds[:, 0]
    asked = TOLERANCE * judged.diagonal
    findings.add(
        "width of point", reached & (width > 1.001 * asked + slack),
        lambda n: f"{points[n].tolist()}: {width[n]}, asked {asked}",
    )  # fmt: skip
    findings.counts += Counter(
        wider=int((~reached).sum()), far=int((found > bounds[:, 1] + 1e-9 * size).sum())
    )
    findings.width = float((width / asked).max())


def check_places(judged: JudgedPart, points: Array, answer: Any, findings: Findings) -> None:
    """Checks that reported points are on the part, at their distances and parameters."""
    positions, distances = np.array(answer["positions"]), np.array(answer["distances"])
    size = judged.size + np.abs(points).max(axis=1)
    apart = np.abs(np.linalg.norm(positions - points, axis=1) - distances)
    findings.add(
        "distance of point", apart > 4 * ROUNDING * size,
        lambda n: f"{points[n].tolist()}: {distances[n]!r} but {positions[n].tolist()}",
    )  # fmt: skip
    face = np.array(answer.get("patch", np.zeros(len(points), np.intp)))
    places, near_edge = np.array(answer["uv"]), np.array(answer["near_edge"])
    on_face = judged.evaluate(face, places)
    from_face = np.linalg.norm(on_face - positions, axis=1)
    # The gap of an edge is that of any of its faces.
    gaps = np.where(near_edge, judged.gaps.max(), judged.gaps[face])
    allowed = ON_PART * size + np.where(near_edge, gaps, 0.0)
    findings.add(
        "position of point", from_face > allowed,
        lambda n: f"{points[n].tolist()}: face {face[n]} is {from_face[n]} from its position",
    )  # fmt: skip
    answers, from_edges = judged.classify(face, places, on_face)
    findings.add(
        "place of point", answers == OUTSIDE,
        lambda n: f"{points[n].tolist()}: outside of face {face[n]} at {places[n].tolist()}, "
        f"{from_edges[n]} from its edges",
    )  # fmt: skip
    # A point near an edge is at most 5/4 of the gap, and the width that is asked for, from it.
    most = 1.5 * gaps + 2 * TOLERANCE * judged.diagonal + ON_PART * size
    from_all = judged.search.find_borders(positions)
    findings.add(
        "near_edge of point", near_edge & (from_all > most),
        lambda n: f"{points[n].tolist()}: {from_all[n]} from all edges",
    )  # fmt: skip
    findings.counts += Counter(near_edge=int(near_edge.sum()))


def compare_signs(judged: JudgedPart, points: Array, answer: Any, findings: Findings) -> None:
    """Compares signs with those of the closed form, or with the number of hits of rays."""
    signs = np.array([0 if s is None else s for s in answer["signs"]])
    size = judged.size
    if judged.case.form is not None:
        values = judged.case.form.measure(points)
        slack = FORM * (size + np.abs(points).max(axis=1))
        truth = np.where(np.abs(values) > slack, np.sign(values), 0)
    else:
        truth = find_signs(judged, points, findings.seed)
    findings.add(
        "sign of point", (truth != 0) & (signs != 0) & (signs != truth),
        lambda n: f"{points[n].tolist()}: {signs[n]}, judge {truth[n]}",
    )  # fmt: skip
    findings.counts += Counter(
        null=int((signs == 0).sum()), judged=int((truth != 0).sum()), signs=len(signs)
    )


def find_signs(judged: JudgedPart, points: Array, seed: int) -> Array:
    """Signs (m,) by the parity of hits of rays in some directions; 0 if they do not agree.

    Searches for hits miss some very near a pole, so signs of points there are 0, too.
    """
    rng = np.random.default_rng([seed, 3])
    votes = np.zeros((SIGN_DIRECTIONS, len(points)))
    for k in range(SIGN_DIRECTIONS):
        directions = _draw_directions(rng, len(points))
        hits = judged.search.find_hits(points, directions, 4000)
        on_face = judged.evaluate(hits.face, hits.places)
        answers, _ = judged.classify(hits.face, hits.places, on_face)
        is_bad = (answers == UNSURE) | (np.abs(hits.sines) < 1e-3) | (hits.t < 1e-9)
        is_lucky = np.bincount(hits.ray[is_bad], minlength=len(points)) == 0
        count = np.bincount(hits.ray[answers == INSIDE], minlength=len(points))
        votes[k] = np.where(is_lucky, np.where(count % 2, -1, 1), 0)
    total = votes.sum(axis=0)
    # All lucky rays agree, and there are two at least.
    agree = (np.abs(total) == np.abs(votes).sum(axis=0)) & (np.abs(total) >= 2)
    poles = np.concatenate([np.zeros((0, 3)), *map(list_poles, judged.part.faces)])
    apart = np.linalg.norm(points[:, np.newaxis] - poles, axis=2).min(axis=1, initial=np.inf)
    return np.asarray(np.where(agree & (apart > NEAR_POLE * judged.diagonal), np.sign(total), 0))
