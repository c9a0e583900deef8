"""The meshes with which the judge is tested: surfaces of every family, each with several meshes."""

import json
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np

from oracles.sheets import PlacedSheet, Sheet, build_sheets
from service.encoders.registry import BY_NAME
from service.encoders.text import json_document
from service.engine.accuracy import Accuracy
from service.engine.mesh_checks.query import CheckQuery
from service.engine.options import MeshOptions
from service.pipeline.mesh import render
from service.schemas.brep import BrepDefinition
from service.schemas.surfaces import definition
from service.surface.brep import BrepSurface
from service.surface.examples.catalogue import EXAMPLES
from service.surface.given_mesh import GivenMesh
from service.surface.group import GroupSurface
from service.surface.sizes import SurfaceKind
from service.surface.sweeps import RibbonSurface, TubeSurface
from tools.certify.groups import build_group
from tools.certify.parts import PARTS, build_part
from tools.certify.surfaces import FAMILIES
from tools.certify.sweeps import SWEEPS
from tools.judge_meshes.meshes import (
    CHANGES,
    Random,
    get_size,
    mesh_by_resolution,
    mesh_by_tolerance,
)
from tools.judge_meshes.open_cascade import mesh_by_open_cascade
from tools.judge_meshes.truths import PartTruth, SheetTruth, SweptTruth, Truth

FIRST = 9000
"""The first seed of all families; other programs use other seeds."""

COUNTS = {"surfaces": 4, "parts": 2, "sweeps": 3, "groups": 8}
"""Surfaces of each family."""

OF_EACH = 6
"""Meshes of each surface."""

LEFT_OUT = {
    *("lines and curves", "almost degenerate", "flat"),
    *("edges of 1e-9", "many holes", "thin parts", "small parts", "gaps"),
}
"""Families whose surfaces have no area, or whose slow truths take long or are coarse: searches for
nearest points end too far away where a patch is folded in its plane, or almost a line."""

TRIANGLES = 1000
"""The most triangles of a mesh, for which slow truths are quick enough."""


@dataclass(frozen=True)
class Case:
    """A mesh: the kind of its surface, a family and a seed there, and the number of the mesh."""

    kind: str
    family: str
    seed: int
    number: int

    def __str__(self) -> str:
        return f"{self.kind}: {self.family} {self.seed}, mesh {self.number}"

    @property
    def rng(self) -> Random:
        """Random numbers that depend on the case alone."""
        return np.random.default_rng([*map(ord, self.kind + self.family), self.seed, self.number])


def list_cases(share: float = 1.0) -> Iterator[Case]:
    """All meshes; with a smaller share, the first of each family."""
    families = {"surfaces": FAMILIES, "parts": PARTS, "sweeps": SWEEPS, "groups": ["groups"]}
    for kind, names in families.items():
        for family in names:
            for seed in range(COUNTS[kind] if family not in LEFT_OUT else 0):
                for number in range(OF_EACH):
                    if number < share * OF_EACH and (share == 1 or seed < share * COUNTS[kind]):
                        yield Case(kind, family, FIRST + seed, number)
    for name in EXAMPLES:
        for number in range(OF_EACH):
            if number < share * OF_EACH:
                yield Case("examples", name, 0, number)


def build_surface(case: Case) -> tuple[SurfaceKind, Truth]:
    """The surface of a case, and its slow truth, whose samples serve all meshes of the surface."""
    return _build_surface(replace(case, number=0))


@lru_cache(maxsize=2)
def _build_surface(case: Case) -> tuple[SurfaceKind, Truth]:
    if case.kind == "examples":
        surface: Any = EXAMPLES[case.family].surface()
        return surface, find_truth(surface)
    if case.kind == "parts":
        part = build_part(case.family, case.seed)
        brep = BrepDefinition.model_validate(part.document).to_surface()
        return brep, PartTruth(part.document, part.truth, part.slack + measure_gap(brep))
    if case.kind == "groups":
        group, sheets = build_group(np.random.default_rng(case.seed))
        return group, SheetTruth(sheets)
    if case.kind == "sweeps":
        sweep = SWEEPS[case.family].surface(case.seed)
        return sweep, SweptTruth(sweep)
    patch = FAMILIES[case.family].surface(case.seed)
    return patch, SheetTruth(build_sheets(patch))


def find_truth(surface: Any) -> Truth:
    """The slow truth of an example."""
    if isinstance(surface, BrepSurface):
        document = json.loads(json_document(definition(surface)))
        return PartTruth(document, None, measure_gap(surface))
    if isinstance(surface, TubeSurface | RibbonSurface):
        return SweptTruth(surface)
    if isinstance(surface, GroupSurface):
        sheets: list[Sheet] = []
        for member in surface.members:
            if member.surface is not None:
                matrix = np.eye(4) if member.matrix is None else member.matrix
                sheets += [PlacedSheet(sheet, matrix) for sheet in build_sheets(member.surface)]
        return SheetTruth(sheets)
    return SheetTruth(build_sheets(surface))


def measure_gap(surface: SurfaceKind) -> float:
    """How far edges are from their faces, as the service bounds it."""
    options = MeshOptions(accuracy=Accuracy(relative_tolerance=1e-2), normals=False)
    report = json.loads(bytes(render(surface, options, BY_NAME["json"])))["report"]
    return float(report.get("gap_bound") or 0.0)


def build_mesh(case: Case, surface: SurfaceKind) -> tuple[str, GivenMesh, CheckQuery]:
    """The words for a mesh, the mesh, and how exactly it is judged."""
    rng = case.rng
    query = CheckQuery(relative_tolerance=float(rng.choice([0.5, 0.3, 0.2, 0.1, 0.05])))
    if case.number == OF_EACH - 1:
        relative = 10 ** rng.uniform(-3, -1)
        size = get_size(mesh_by_tolerance(surface, 0.1))
        made = mesh_by_open_cascade(surface, relative * size)
        if made is not None and len(made.triangles) <= TRIANGLES:
            return f"Open CASCADE at {relative:.2g}", made, query
    by_resolution = case.kind in ("surfaces", "groups") and rng.random() < 0.3
    if by_resolution:
        divisions = int(rng.integers(1, 12))
        text, mesh = f"resolution {divisions}", mesh_by_resolution(surface, divisions)
    else:
        relative = 10 ** rng.uniform(-3, -1)
        text, mesh = f"tolerance {relative:.2g}", mesh_by_tolerance(surface, relative)
        while len(mesh.triangles) > TRIANGLES:
            relative *= 3
            text, mesh = f"tolerance {relative:.2g}", mesh_by_tolerance(surface, relative)
    # The first of each surface is left as it is.
    if case.number:
        name = list(CHANGES)[(case.seed + len(case.family) + case.number) % len(CHANGES)]
        text, mesh = f"{text}, {name}", CHANGES[name](mesh, rng)
    return text, mesh, query
