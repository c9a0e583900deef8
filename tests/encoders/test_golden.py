"""Files of a small mesh, the silo, in every format are equal to those in `tests/golden`.

A difference means that clients get other bytes. Correct the encoder; or, if the change is intended,
write the files again with `python -m tests.encoders.test_golden`, and read the difference.
"""

from pathlib import Path

import pytest

from service.encoders.format import EncodeOptions, OoglForm
from service.encoders.registry import BY_NAME
from tools.meshes import add_attributes, add_overlays, build_silo, to_single

FOLDER = Path(__file__).parents[1] / "golden"

FILES: dict[str, OoglForm | None] = {
    "silo.glb": None,
    "silo.gltf": None,
    "silo.json": None,
    "silo.oogl": None,
    "silo-mesh.oogl": "mesh",
    "silo-off.oogl": "off",
    "silo.stl": None,
    "silo.obj": None,
    "silo.ply": None,
    "silo.off": None,
    "silo.npz": None,
    "silo-colors.glb": None,
    "silo-colors.gltf": None,
    "silo-colors.json": None,
    "silo-colors.oogl": None,
    "silo-colors-mesh.oogl": "mesh",
    "silo-colors-off.oogl": "off",
    "silo-colors.obj": None,
    "silo-colors.ply": None,
    "silo-colors.off": None,
    "silo-colors.npz": None,
}
"""Names of the golden files, with the form of OOGL."""


def render_golden(file: str) -> bytes:
    """The file of the silo in the format of this golden file."""
    fmt = BY_NAME[file.rpartition(".")[2]]
    mesh = add_overlays(build_silo(faces="quads" if fmt.has_quads else "triangles"))
    if "colors" in file:
        mesh = add_attributes(mesh)
    if fmt.is_float32:
        mesh = to_single(mesh, (10.0, 0.0, 0.5), "z")
    return bytes(fmt.encode(mesh, EncodeOptions(FILES[file])))


@pytest.mark.parametrize("file", FILES)
def test_files_are_equal_to_the_golden_files(file: str) -> None:
    assert render_golden(file) == (FOLDER / file).read_bytes()


if __name__ == "__main__":
    for file in FILES:
        (FOLDER / file).write_bytes(render_golden(file))
