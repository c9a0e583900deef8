"""Rows of the table: one mesh each, as the judge sees it."""

import json
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from service.engine.mesh_checks.query import CheckQuery
from service.pipeline.check import plan_check
from service.surface.given_mesh import GivenMesh
from service.surface.sizes import SurfaceKind

QUERY = CheckQuery(relative_tolerance=0.2)
"""How exactly meshes are judged."""


@dataclass(frozen=True)
class Row:
    """One mesh: who made it, of what, and what the judge found.

    `relative` is the tolerance as a share of the diagonal. `to_mesh` and `to_surface` are the
    intervals of the largest distance from the surface to the mesh, and from the mesh to the
    surface, divided by the tolerance. A row with an `error` has no mesh. `open_edges` counts the
    edges with one triangle or with more than two, `flipped` those that two triangles run along in
    the same direction.
    """

    case: str
    group: str
    is_closed: bool
    maker: str
    relative: float
    asked: str
    error: str = ""
    triangles: int = 0
    seconds: float = 0.0
    to_mesh: tuple[float, float] = (0.0, 0.0)
    to_surface: tuple[float, float] = (0.0, 0.0)
    open_edges: int = 0
    flipped: int = 0
    degenerate: int = 0
    reached: bool = True

    @property
    def is_made(self) -> bool:
        """Whether there is a mesh, which was judged."""
        return not self.error

    @property
    def is_over(self) -> bool:
        """Whether a point of the surface is certainly further away than was asked for."""
        return self.is_made and self.to_mesh[0] > 1

    @property
    def is_torn(self) -> bool:
        """Whether the surface is closed and its mesh is not."""
        return self.is_made and self.is_closed and self.open_edges > 0


def judge(
    surface: SurfaceKind, vertices: NDArray[np.float64], faces: NDArray[np.int64], tolerance: float
) -> dict[str, Any]:
    """The fields of a row that the service finds, by what `POST /v1/check` computes."""
    mesh = GivenMesh(np.array(vertices), np.array(faces))
    answer = json.loads(bytes(plan_check(surface, mesh, QUERY).run()))
    intervals = {
        field: tuple(answer[name][end] / tolerance for end in ("low", "high"))
        for field, name in (("to_mesh", "surface_to_mesh"), ("to_surface", "mesh_to_surface"))
    }
    return {
        **intervals,
        "triangles": answer["triangles"],
        "open_edges": answer["open_edges"] + answer["non_manifold_edges"],
        "flipped": answer["flipped_edges"],
        "degenerate": answer["degenerate_faces"],
        "reached": answer["reached"],
    }


def save(rows: list[Row], versions: dict[str, str], path: Path) -> None:
    """Writes rows and the versions of makers as JSON."""
    content = {"versions": versions, "rows": [asdict(row) for row in rows]}
    path.write_text(json.dumps(content, indent=1), encoding="utf-8")


def load(path: Path) -> tuple[list[Row], dict[str, str]]:
    """Rows and versions that were saved."""
    content = json.loads(path.read_text(encoding="utf-8"))
    fields = ("to_mesh", "to_surface")
    rows = [Row(**row | {name: tuple(row[name]) for name in fields}) for row in content["rows"]]
    return rows, content["versions"]
