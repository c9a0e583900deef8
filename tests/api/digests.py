"""Computes hashes of mesh files in every coding; as a program, this module prints them."""

import hashlib
from dataclasses import replace

from service.api.caching.codings import COMPRESS_FUNCTIONS
from service.encoders.registry import BY_NAME, FORMATS
from service.engine.accuracy import Accuracy
from service.engine.options import MeshOptions
from service.pipeline.mesh import render
from service.surface.examples.catalogue import find
from tools.certify.crowded import build_crowded, build_mixed
from tools.certify.nearly import build_noisy

OPTIONS = MeshOptions((3, 3), uvs=True, overlays=("boundary", "control_net"))


def compute_digests() -> list[str]:
    """A line for each file: the hashes of its bytes, and of its bytes in every coding.

    The surfaces: three with borders that are joined although they differ by rounding, degrees or
    knots, by resolution and by tolerance (GLB without coding); a surface with colours, one with
    attributes, and a group (in all formats).
    """
    seed = 4
    lines = []
    for build in (build_noisy, build_mixed, build_crowded):
        surface = build(seed).surface
        for options in (MeshOptions((3, 5)), MeshOptions(accuracy=Accuracy(tolerance=0.1))):
            content = render(surface, options, BY_NAME["glb"])
            lines.append(hashlib.sha256(content).hexdigest())
    for name in ("bourke-1111-colors", "heated-panel", "tea-service"):
        for fmt in FORMATS:
            options = OPTIONS if fmt.has_overlays else replace(OPTIONS, overlays=())
            content = render(find(name).surface(), options, fmt)
            codings = (content, *(compress(content) for compress in COMPRESS_FUNCTIONS.values()))
            lines.append(" ".join(hashlib.sha256(each).hexdigest() for each in codings))
    return lines


if __name__ == "__main__":
    print("\n".join(compute_digests()))
