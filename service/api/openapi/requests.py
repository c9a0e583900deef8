"""Examples of requests in the OpenAPI document: a summary and a value by name, by operation."""

import json
from pathlib import Path
from typing import Any, TypeAlias

Json: TypeAlias = dict[str, Any]

_FILE = Path(__file__).with_suffix(".json")

REQUESTS: dict[str, Json] = json.loads(_FILE.read_text(encoding="utf-8"))
_MESHES = REQUESTS["createMesh"]


def _of_mesh(name: str, summary: str, **changed: Any) -> Json:
    return {"summary": summary, "value": _MESHES[name]["value"] | changed}


REQUESTS["estimateMesh"] = {
    "patch": _MESHES["patch"],
    "quads": _of_mesh("patches", "Quads, for which some formats have no place"),
    "huge": _of_mesh("patch", "More vertices than are answered in any format", resolution=60_000),
    "tolerance": _of_mesh("tolerance", "By tolerance: no more than this comes out"),
    "tube": _of_mesh("tube", "A tube, whose vertices are counted as many as they may be"),
}
REQUESTS["storeSurface"] = {
    name: _MESHES[name] | {"value": {"surface": _MESHES[name]["value"]["surface"]}}
    for name in ("patch", "rational", "nurbs", "group")
}
