"""Judges sections of solids: closed loops, areas, and volumes from many sections.

    python -m tools.judge.sections [planes] [solid …]

The valid solids of the tests are cut by 200 planes together: coordinate planes through the middles
of their boxes, which often are planes of symmetry; planes through three vertices, which contain
edges and faces; and random ones. Each section must consist of closed loops. Its area by Green's
theorem must agree with that of a section with a tenth of the tolerance, up to both bounds along the
loops. Further `SLICES` planes give the volume, which Open CASCADE has computed. The exit status is
1 if anything is wrong.
"""

import sys
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from oracles.brep_documents import Array
from oracles.solids import MEASURES, VALID, read_solid
from service.engine.parts.build import build_part
from service.engine.parts.part import Part
from service.engine.parts.sections.cut import cut_part
from service.engine.sections.values import Planes, Sections
from service.schemas.request import MeshRequest
from service.schemas.validation import validate_document
from service.surface.brep import BrepSurface

PLANES, SEED = 200, 7
"""Planes of all solids together, and the seed of the random ones."""

COARSE, FINE = 1e-3, 1e-4
"""Tolerances, as shares of the diagonal."""

SLICES, VOLUME_ERROR = 64, 0.02
"""Sections from which the volume is computed, and the largest relative error of it: the areas of
solids with faces across the planes jump."""

MOST_PIECES = 1_000_000
"""No section of these solids has more pieces."""


@dataclass
class Verdict:
    """The findings about one solid."""

    name: str
    planes: int = 0
    loops: int = 0
    wide: int = 0
    faults: tuple[str, ...] = ()


def allow(count: int) -> None:
    """Refuse more pieces than any section has."""
    if count > MOST_PIECES:
        raise RuntimeError(f"{count} pieces")


def draw_planes(part: Part, count: int, rng: np.random.Generator) -> Iterator[tuple[Array, float]]:
    """Planes of a solid: through the middle, through vertices, and random ones."""
    prepared = part.members.definitions[0]
    (low, high), vertices = prepared.box, prepared.vertices
    for k in range(count):
        if k < 3:
            normal = np.eye(3)[k]
            yield normal, float(normal @ (low + high) / 2)
        elif k % 2 and len(vertices) > 2:
            a, b, c = vertices[rng.choice(len(vertices), 3, replace=False)]
            normal = np.cross(b - a, c - a)
            size = float(np.linalg.norm(normal))
            normal = normal / size if size > 1e-6 * part.diagonal**2 else np.eye(3)[k % 3]
            yield normal, float(normal @ a)
        else:
            normal = rng.normal(size=3)
            normal /= np.linalg.norm(normal)
            yield normal, float(normal @ (low + (high - low) * rng.uniform(0.1, 0.9, 3)))


def measure_areas(sections: Sections) -> Array:
    """The areas by Green's theorem."""
    x, y = sections.planes.axes
    areas = np.zeros(len(sections.sections))
    for k, section in enumerate(sections.sections):
        for line in section.polylines:
            points = line.points - line.points[0]
            a, b = points @ x[k], points @ y[k]
            areas[k] += float((a[:-1] * b[1:] - a[1:] * b[:-1]).sum()) / 2
    return areas


def measure_lengths(sections: Sections) -> Array:
    """The lengths of all lines of each section."""
    return np.array(
        [
            sum(
                float(np.linalg.norm(np.diff(line.points, axis=0), axis=1).sum())
                for line in section.polylines
            )
            for section in sections.sections
        ]
    )


def judge_solid(name: str, document: Any, count: int, volume: float) -> Verdict:
    """Cut a solid by a number of planes, and say what is wrong."""
    surface = validate_document(MeshRequest, {"surface": document}).to_surface()
    assert isinstance(surface, BrepSurface)
    part = build_part(surface.lower())
    rng = np.random.default_rng(SEED)
    normals, offsets = zip(*draw_planes(part, count, rng), strict=True)
    planes = Planes(np.array(normals), np.array(offsets))
    found = [cut_part(part, planes, share * part.diagonal, allow) for share in (COARSE, FINE)]
    verdict, faults = Verdict(name, count), []
    for share, sections in zip((COARSE, FINE), found, strict=True):
        verdict.loops += len(sections.polylines)
        verdict.wide += sections.deviation_bound > share * part.diagonal
        faults += [
            f"{name}, plane {k} at {share}: a line is not closed"
            for k, section in enumerate(sections.sections)
            if not all(line.closed for line in section.polylines)
        ]
    coarse, fine = (measure_areas(sections) for sections in found)
    reach = sum(sections.deviation_bound for sections in found)
    allowed = 2 * reach * measure_lengths(found[1]) + 1e-9 * part.diagonal**2
    faults += [
        f"{name}, plane {k}: the area is {coarse[k]}, and {fine[k]} by a finer section"
        for k in np.flatnonzero(np.abs(coarse - fine) > allowed).tolist()
    ]
    low, high = part.members.definitions[0].box[:, 0]
    steps = low + (np.arange(SLICES) + 0.5) / SLICES * (high - low)
    slices = Planes(np.tile([1.0, 0.0, 0.0], (SLICES, 1)), steps)
    areas = measure_areas(cut_part(part, slices, COARSE * part.diagonal, allow))
    total = float(areas.sum() * (high - low) / SLICES)
    if abs(total - volume) > VOLUME_ERROR * volume:
        faults.append(f"{name}: the volume is {total} by sections, and {volume}")
    verdict.faults = tuple(faults)
    return verdict


def main(arguments: list[str]) -> int:
    """Judge all solids, or those that are named."""
    names = [each for each in arguments if not each.isdigit()] or list(VALID)
    planes = next((int(each) for each in arguments if each.isdigit()), PLANES)
    count = -(-planes // len(names))
    faults: list[str] = []
    print(f"{'':14}{'planes':>8}{'loops':>8}{'wide':>8}{'wrong':>8}")
    for name in names:
        verdict = judge_solid(name, read_solid(name), count, MEASURES[name]["volume"])
        faults += verdict.faults
        row = (verdict.planes, verdict.loops, verdict.wide, len(verdict.faults))
        print(f"{name:14}" + "".join(f"{each:8}" for each in row), flush=True)
    print("\n".join(faults))
    print("Something is wrong." if faults else "Nothing is wrong.")
    return int(bool(faults))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
