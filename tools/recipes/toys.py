"""Small examples for the recipes of CONTRIBUTING.md: a format, an option, a kind of surface."""

from tools.recipes.steps import Recipe, Step

FORMAT = Recipe(
    max_files=3,
    steps=(
        Step(
            "service/encoders/xyz.py",
            '''"""Encodes the vertices of a mesh as text, one line for each: x y z."""

from service.encoders.format import EncodeOptions, MeshSize
from service.engine.mesh.mesh import Mesh


def encode(mesh: Mesh, _options: EncodeOptions) -> bytes:
    """The file."""
    return "".join(f"{x!r} {y!r} {z!r}\\n" for x, y, z in mesh.positions.tolist()).encode()


def byte_bound(size: MeshSize, _options: EncodeOptions) -> int:
    """An upper bound of the number of bytes."""
    return size.vertices * 3 * 25
''',
        ),
        Step(
            "service/encoders/registry.py",
            insertions=(
                (
                    "from collections.abc import Mapping\n",
                    "from service.encoders import xyz\n",
                ),
                (
                    """        byte_bound=off.byte_bound,
        carries=frozenset({"colors"}),
    ),
""",
                    """    Format(
        name="xyz",
        title="Points as text",
        media_type="text/x-xyz",
        suffix="xyz",
        is_float32=False,
        has_quads=True,
        has_overlays=False,
        encode=xyz.encode,
        byte_bound=xyz.byte_bound,
    ),
""",
                ),
            ),
        ),
        Step(
            "tests/encoders/test_xyz.py",
            """from service.encoders import xyz
from service.encoders.format import EncodeOptions
from tools.meshes import build_silo


def test_a_line_for_every_vertex() -> None:
    mesh = build_silo()
    assert xyz.encode(mesh, EncodeOptions()).count(b"\\n") == len(mesh.positions)
""",
        ),
    ),
    tests=(
        "tests/encoders/test_registry.py",
        "tests/encoders/test_every_surface.py",
        "tests/encoders/test_xyz.py",
        "tests/pipeline/test_compact.py",
        "tests/pipeline/test_estimate.py",
        "tests/api/test_negotiation.py",
        "tests/cli/test_main.py",
    ),
)

OPTION = Recipe(
    max_files=5,
    steps=(
        Step(
            "service/engine/options.py",
            insertions=(("    curvatures: bool = False\n", "    inside_out: bool = False\n"),),
        ),
        Step(
            "service/schemas/options.py",
            insertions=(
                (
                    "        examples=[16, [16, 32]],\n    )\n",
                    """    inside_out: bool = Field(
        default=_DEFAULTS.inside_out,
        description="Whether the winding of all faces is reversed.",
        examples=[True],
    )
""",
                ),
            ),
        ),
        Step(
            "service/engine/tessellate.py",
            insertions=(
                (
                    "    rows = fill_vertices(rows, plan)\n",
                    """    if options.inside_out:
        plan = replace(plan, triangles=plan.triangles[:, ::-1])
""",
                ),
            ),
        ),
        Step(
            "service/client/fields.py",
            insertions=(("    curvatures: bool\n", "    inside_out: bool\n"),),
        ),
        Step(
            "tests/engine/test_inside_out.py",
            """import numpy as np

from service.engine.options import MeshOptions
from service.engine.tessellate import tessellate
from tools.examples import lower_patches


def test_tessellate_reverses_faces() -> None:
    model = lower_patches("saddle")
    plain, reversed_mesh = (tessellate(model, MeshOptions(inside_out=b)) for b in (False, True))
    assert np.array_equal(plain.triangles[:, ::-1], reversed_mesh.triangles)
""",
        ),
    ),
    tests=(
        "tests/engine/test_inside_out.py",
        "tests/schemas",
        "tests/cli/test_main.py",
        "tests/api/test_mesh.py",
        "tests/client/test_fields.py",
    ),
)

KIND = Recipe(
    max_files=6,
    steps=(
        Step(
            "service/surface/ramp.py",
            '''"""A flat patch over the unit square that rises along u."""

from dataclasses import dataclass

import numpy as np

from service.surface.batches import TensorPatches
from service.surface.channels import NO_CHANNELS
from service.surface.checks import Up
from service.surface.lowered import Part, PatchModel
from service.surface.sizes import SurfaceKind, SurfaceSize, tensor_size


@dataclass(frozen=True, slots=True)
class RampSurface(SurfaceKind):
    """A flat patch that rises from z = 0 at u = 0 to this height at u = 1."""

    height: float
    up: Up = "y"
    name: str = "surface"

    def size(self) -> SurfaceSize:
        return tensor_size(1, (1, 1), None, NO_CHANNELS, name=self.name)

    def lower(self) -> PatchModel:
        net = np.array([[[0.0, 0, 0], [0, 1, 0]], [[1, 0, self.height], [1, 1, self.height]]])
        batch = TensorPatches(net[np.newaxis])
        return PatchModel(self.name, (batch,), (Part(self.name, 0, 1),), self.up)
''',
        ),
        Step(
            "service/surface/kinds.py",
            insertions=(
                (
                    "from service.surface.patches import PatchSurface\n",
                    "from service.surface.ramp import RampSurface\n",
                ),
                ("    BezierSurface\n", "    | RampSurface\n"),
            ),
        ),
        Step(
            "service/schemas/ramp.py",
            '''"""The JSON of a ramp."""

from typing import Literal

from pydantic import Field

from service.schemas.fields import NameField, StrictModel, UpField
from service.surface.ramp import RampSurface


class RampDefinition(StrictModel):
    """A flat patch over the unit square that rises along u."""

    type: Literal["ramp"] = Field(description="The kind of surface.")
    height: float = Field(ge=-1e6, le=1e6, description="Height at u = 1.", examples=[0.5])
    up: UpField = "y"
    name: NameField = "surface"

    def to_surface(self) -> RampSurface:
        """The surface that the document defines."""
        return RampSurface(self.height, self.up, self.name)

''',
        ),
        Step(
            "service/schemas/kinds.py",
            insertions=(
                (
                    "from service.schemas import bezier, brep, bspline, patches",
                    ", ramp",
                ),
                (
                    "from service.surface.patches import PatchSurface\n",
                    "from service.surface.ramp import RampSurface\n",
                ),
                (
                    '        MultipatchSurface: ("multipatch", "surfaces"),\n',
                    '        RampSurface: ("ramp", "height"),\n',
                ),
                (
                    '    | Annotated[bspline.BsplineDefinition, Tag("bspline")]\n',
                    '    | Annotated[ramp.RampDefinition, Tag("ramp")]\n',
                ),
            ),
        ),
        Step(
            "service/api/openapi/requests.json",
            insertions=(
                (
                    '  "createMesh": {\n',
                    """    "ramp": {
      "summary": "A ramp",
      "value": {"surface": {"type": "ramp", "height": 0.5}, "resolution": 1}
    },
""",
                ),
            ),
        ),
        Step(
            "tests/surface/test_ramp.py",
            """from service.surface.ramp import RampSurface


def test_a_ramp_is_one_patch() -> None:
    assert RampSurface(0.5).lower().patch_count == RampSurface(0.5).size().patches == 1
""",
        ),
    ),
    tests=(
        "tests/surface/test_ramp.py",
        "tests/surface/test_sizes.py",
        "tests/schemas",
        "tests/storage",
        "tests/api/test_mesh.py",
    ),
)
