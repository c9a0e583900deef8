"""What clients may ask for, written by hand: other tests take their lists from the registries."""

from collections.abc import Iterable

import pytest

from service.decoders.registry import DECODERS
from service.encoders.curves.registry import CURVE_FORMATS
from service.encoders.registry import FORMATS
from service.schemas.convert import OPERATIONS
from service.schemas.options import MeshOptionFields
from service.schemas.surfaces import KINDS
from service.surface.examples import EXAMPLES


@pytest.mark.parametrize(
    ("names", "promised"),
    [
        ([fmt.name for fmt in FORMATS], "glb gltf json oogl stl obj ply off"),
        ([fmt.name for fmt in CURVE_FORMATS], "glb gltf json oogl obj"),
        ([decoder.name for decoder in DECODERS], "npy oogl teapot"),
        (KINDS, "bezier bspline triangle patches tube ribbon group"),
        (OPERATIONS, "elevate split restrict transpose reverse bezier triangle"),
        (
            MeshOptionFields.model_fields,
            "resolution tolerance relative_tolerance angle_tolerance max_triangles max_bytes"
            " two_sided faces normals uvs curvatures weld crease_angle overlays isocurves wires"
            " wire_width wire_sides method oogl quantize compression",
        ),
        (
            EXAMPLES,
            "utah-teapot utah-teapot-original bourke-1111 bourke-1111-colors tveit saddle"
            " heated-panel cylinder cone sphere torus monkey-saddle octahedral-sphere rounded-box"
            " trefoil-tube ribbon hair tea-service bspline-hills nurbs-goblet bspline-ring",
        ),
    ],
    ids=["formats", "curves", "files", "kinds", "operations", "options", "examples"],
)
def test_nothing_is_lost_and_nothing_new_goes_unseen(names: Iterable[str], promised: str) -> None:
    assert list(names) == promised.split()
