"""Netgen: its mesher of surfaces, with sizes from curvature.

Netgen has no tolerance of distances. It takes the number of elements for a radius of curvature,
and bounds the sizes of elements.
"""

from importlib.metadata import version
from typing import Any

import numpy as np
from netgen.meshing import MeshingStep
from netgen.occ import OCCGeometry

from tools.judge_peers.makers.protocol import Fields, Mesher, serve


def load(request: Fields) -> Mesher:
    """Reads the STEP file."""
    geometry = OCCGeometry(request["file"])

    def mesh() -> tuple[Any, Any]:
        result = geometry.GenerateMesh(
            maxh=request["largest"],
            curvaturesafety=request["elements"],
            perfstepsend=MeshingStep.MESHSURFACE,
        )
        faces = [[corner.nr - 1 for corner in each.vertices] for each in result.Elements2D()]
        return np.array([each.p for each in result.Points()]), np.array(faces)

    return mesh


if __name__ == "__main__":
    serve(f"netgen-mesher {version('netgen-mesher')}", load)
