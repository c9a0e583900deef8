"""Judges `inside` of `/v1/points` on parts: points of faces at given parameters.

Parameters are anywhere in the domain, near loops on both sides, on loops, and on the borders of the
domain, where seams and poles are. `wrong`: the answer is not that of the winding number of the
judge's own loops; or it is given although an edge is nearer than its gap; or null further away from
all edges. `null`: the service does not decide. `unsure`: the judge does not.
"""

from collections import Counter

import numpy as np

from oracles.brep_documents import Array, Index
from oracles.parts import INSIDE, UNSURE, Face
from tools.judge.findings import Findings
from tools.judge.judged_part import JudgedPart

SLACK = 1e-9
"""Share of the size of the part: a null is right so near to an edge, whatever its gap is."""


def judge_points(judged: JudgedPart, count: int, seed: int) -> Findings:
    """The findings about `count` parameters."""
    rng = np.random.default_rng([seed, 1])
    faces = judged.part.faces
    share = rng.multinomial(count, np.full(len(faces), 1 / len(faces)))
    rows = [draw_places(face, n, rng) for face, n in zip(faces, share.tolist(), strict=True)]
    places = np.concatenate(rows)
    face: Index = np.repeat(np.arange(len(faces)), list(map(len, rows)))
    answer = judged.ask("points", uv=places.tolist(), patch=face.tolist(), derivatives=0)
    inside = np.array([{True: 1, False: 0, None: -1}[each] for each in answer["inside"]])
    positions = np.array(answer["positions"])
    points = judged.evaluate(face, places)
    truth, distances = judged.classify(face, places, points)
    gaps = judged.gaps[face]
    size = judged.size
    is_sure = truth != UNSURE
    is_wrong = np.abs(positions - points).max(axis=1) > 1e-13 * size
    is_wrong |= is_sure & (inside != truth) & (inside != -1)
    # Within the gap nothing is decided.
    least = judged.least_gaps[face]
    is_wrong |= (inside != -1) & (distances < least * (1 - 1e-6) - 2.0**-41 * size)
    is_wrong |= (inside == -1) & is_sure & (distances > 1.3 * gaps + SLACK * size)
    findings = Findings(judged.case.name, seed)
    findings.add(
        "parameters", is_wrong,
        lambda n: f"face {face[n]} at {places[n].tolist()}: {inside[n]}, judge {truth[n]}, "
        f"{distances[n]:.3g} from an edge, gap {gaps[n]:.3g}",
    )  # fmt: skip
    findings.counts += Counter(
        places=len(places), null=int((inside == -1).sum()), unsure=int((~is_sure).sum()),
        inside=int((truth == INSIDE).sum()),
    )  # fmt: skip
    return findings


def draw_places(face: Face, count: int, rng: np.random.Generator) -> Array:
    """About `count` parameters of a face, of all kinds."""
    low, high = face.domain
    some = max(1, count // 4)
    anywhere = low + rng.random((some, 2)) * (high - low)
    box = face.box
    in_box = box[0] + rng.random((some, 2)) * (box[1] - box[0])
    sides = in_box.copy()
    axis = rng.integers(0, 2, some)
    sides[np.arange(some), axis] = np.where(rng.random(some) < 0.5, low[axis], high[axis])
    rows = [anywhere, in_box, sides[: some // 3 + 1]]
    region = face.region
    if region is not None:
        piece = rng.integers(0, len(region.starts), 2 * some)
        along = (region.ends - region.starts)[piece]
        across = np.column_stack([-along[:, 1], along[:, 0]])
        across /= np.maximum(np.hypot(*across.T), 1e-300)[:, np.newaxis]
        offset = 10 ** rng.uniform(-12, -1, 2 * some) * rng.choice([-1, 1], 2 * some)
        offset[rng.random(2 * some) < 0.05] = 0.0
        unit = (
            region.starts[piece]
            + rng.random((2 * some, 1)) * along
            + offset[:, np.newaxis] * across
        )
        rows.append(region.low + unit * region.size)
    places = np.concatenate(rows)
    return np.asarray(np.clip(places, low, high))
