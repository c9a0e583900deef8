"""arris: its tessellation to a chord tolerance.

Its documentation promises that every position of the mesh is within the chord of the surface it
stands on, and that shared edges are closed.
"""

from importlib.metadata import version
from pathlib import Path
from typing import Any

import arris
import numpy as np

from tools.judge_peers.makers.protocol import Fields, Mesher, serve


def load(request: Fields) -> Mesher:
    """Reads the STEP file."""
    model = arris.Model()
    read = model.read_step(Path(request["file"]).read_text(encoding="utf-8"))
    refused = [each.refusal.message for each in read.solids if not each.ok]
    if refused or not read.solids:
        raise ValueError(f"not read: {refused[0] if refused else 'no bodies'}")

    def mesh() -> tuple[Any, Any]:
        meshes = [model.tessellate(each.body, request["tolerance"]) for each in read.solids]
        counts = np.cumsum([0, *(each.n_positions for each in meshes)])
        arrays = [each.to_numpy() for each in meshes]
        faces = [
            rows.astype(np.int64) + first for (_, rows), first in zip(arrays, counts, strict=False)
        ]
        return np.concatenate([vertices for vertices, _ in arrays]), np.concatenate(faces)

    return mesh


if __name__ == "__main__":
    serve(f"arris {version('arris')}", load)
