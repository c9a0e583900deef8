"""Files of control points on the command line, read by this process or by a service."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from service.cli.main import main
from service.encoders.format import EncodeOptions
from service.encoders.registry import BY_NAME
from service.engine.options import MeshOptions
from service.pipeline.mesh import render
from service.surface.examples.catalogue import find
from tools.hostile.files import GEOMDL_SQUARE, OBJ_SQUARE

TEAPOT = "2\n1,2,3,4\n3,4,5,6\n6\n0,0,0\n0,1,0\n1,0,1\n1,1,1\n2,0,0\n2,1,0\n"
"""A file of the format `teapot`: 2 patches of 2 × 2 points each, which share 2 of the 6 points."""


@pytest.fixture
def files(tmp_path: Path) -> Path:
    """A folder with files of all formats of control points."""
    net = np.zeros((5, 6, 4))
    net[..., 0], net[..., 1] = np.indices((5, 6))
    net[..., 2], net[..., 3] = net[..., 0] * net[..., 1] % 3, 1 + net[..., 0] % 2
    np.save(tmp_path / "net.npy", net)
    half = np.array([[[1, 0, z, 1], [0, 1, 0, 0], [-1, 0, z, 1]] for z in (0, 2)], float)
    np.save(tmp_path / "half.npy", half)
    np.save(tmp_path / "single.npy", np.asfortranarray(net[..., :3], dtype=">f4"))
    saddle = find("saddle").surface()
    patches = render(saddle, MeshOptions(), BY_NAME["oogl"], EncodeOptions(oogl="bez"))
    for name in ("saddle.bez", "saddle.bbp", "saddle.oogl"):
        (tmp_path / name).write_bytes(patches)
    (tmp_path / "strip.teapot").write_text(TEAPOT, encoding="ascii")
    (tmp_path / "strip.txt").write_text(TEAPOT, encoding="ascii")
    (tmp_path / "square.obj").write_bytes(OBJ_SQUARE)
    (tmp_path / "square.json").write_bytes(GEOMDL_SQUARE)
    (tmp_path / "square.geomdl").write_bytes(GEOMDL_SQUARE)
    fields = {"type": "bspline", "degree": [3, 2], "knots": ["clamped", "periodic"], "name": "n"}
    document = fields | {"control_net": net[..., :3].tolist(), "weights": net[..., 3].tolist()}
    (tmp_path / "net.json").write_text(json.dumps(document), encoding="utf-8")
    return tmp_path


SPLINE = ["--type", "bspline", "--degree", "3,2", "--knots", "clamped,periodic", "--name", "n"]
FLAGS: dict[str, list[str]] = {
    "net.npy": [],
    "single.npy": ["--up", "z", "--resolution", "2"],
    "half.npy": ["--homogeneous", "--resolution", "4"],
    "saddle.bez": ["--tolerance", "0.1"],
    "saddle.bbp": [],
    "saddle.oogl": ["--name", "saddle"],
    "strip.teapot": ["--faces", "quads"],
    "strip.txt": ["--input-format", "teapot"],
    "square.obj": ["--name", "square"],
    "square.json": ["--up", "z"],
    "square.geomdl": [],
}
"""Flags of `surface mesh` by the name of the input file."""


@pytest.mark.parametrize("name", FLAGS)
def test_local_and_remote_meshes_are_equal(server: str, files: Path, name: str) -> None:
    local, remote = files / "local.json", files / "remote.json"
    command = ["mesh", str(files / name), *FLAGS[name]]
    assert main([*command, "-o", str(local)]) == 0
    assert main([*command, "-o", str(remote), "--url", server]) == 0
    assert local.read_bytes() == remote.read_bytes()


def test_an_array_with_flags_equals_the_json_document(files: Path) -> None:
    from_array, from_json = files / "array.glb", files / "json.glb"
    assert main(["mesh", str(files / "net.npy"), *SPLINE, "-o", str(from_array)]) == 0
    assert main(["mesh", str(files / "net.json"), "-o", str(from_json)]) == 0
    assert from_array.read_bytes() == from_json.read_bytes()


@pytest.mark.parametrize(
    "command",
    [["estimate"], ["convert", "--split", "u=0.5"], ["points", "--uv", "0.25,0.5"]],
    ids=lambda command: command[0],
)
def test_other_commands_read_arrays_too(server: str, files: Path, command: list[str]) -> None:
    """An array with flags and the JSON document give equal results, local and remote."""
    results: list[Any] = []
    for source in ([str(files / "net.npy"), *SPLINE], [str(files / "net.json")]):
        for url_flags in ([], ["--url", server]):
            output = files / "result.json"
            assert main([*command, *source, *url_flags, "-o", str(output)]) == 0
            results.append(json.loads(output.read_bytes()))
    assert all(result == results[0] for result in results)


REFUSALS: list[tuple[list[str], int, str]] = [
    (["net.npy", "--type", "tube"], 1, "--type: "),
    (["net.npy", "--type", "bspline", "--degree", "99"], 1, "--degree: "),
    (["net.npy", "--type", "bspline", "--knots", "none"], 1, "--knots: "),
    (["net.npy", "--knots", "clamped"], 1, "--knots: No field has this name"),
    (["single.npy", "--homogeneous"], 1, "/surface/control_net/0/0: A homogeneous control point"),
    (["saddle.bez", "--homogeneous"], 2, "--homogeneous: Other files than arrays of NumPy"),
    (["net.npy", "--up", "x"], 1, "--up: "),
    (["net.npy", "--input-format", "oogl"], 1, "The service reads OOGL as text"),
    (["net.npy", "--input-format", "json"], 1, "The text is not"),
    (["net.npy", "--input-format", "xyz"], 2, "--input-format: unknown"),
    (["net.npy", "--resolution", "0"], 1, "--resolution: "),
    (["strip.txt"], 1, "The text is not JSON at line 2"),
    (["saddle.bez", "--input-format", "teapot"], 1, "A number is needed here (line 1)."),
    (["net.json", "--degree", "3"], 2, "--degree: only for files of control points"),
    (["missing.npy"], 2, "no such file"),
]
"""Arguments, the exit code, and the beginning of the error."""


@pytest.mark.parametrize("number", range(len(REFUSALS)), ids=lambda k: str(REFUSALS[k]))
def test_errors_name_the_flag_or_the_line(
    server: str, files: Path, capsys: pytest.CaptureFixture[str], number: int
) -> None:
    (source, *flags), code, text = REFUSALS[number]
    # Every second case calls `surface estimate`, which reads files in the same way.
    command = (["mesh", "--format", "off"], ["estimate"])[number % 2]
    for url_flags in ([], ["--url", server]):
        assert main([*command, str(files / source), *flags, *url_flags, "-o", "-"]) == code
        assert capsys.readouterr().err.startswith(f"surface: {text}")


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("surface.xml", b"<xml></xml>", ["G+Smo", "IGES"]),
        ("patch.bv", b"4\n3 3\n", ["BezierView", "OOGL"]),
        ("scene.rib", b"##RenderMan RIB\n", ["RenderMan", "NuPatch"]),
        ("scene.usda", b"#usda 1.0\n", ["Universal Scene Description", "NurbsPatch"]),
        ("mesh.3ds", b"MM", ["triangles or polygons", "STEP or IGES"]),
        ("mesh.txt", b"ply\nformat ascii 1.0\n", ["triangles or polygons", "STEP or IGES"]),
    ],
)
def test_files_of_other_programs_are_named(
    name: str, content: bytes, words: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / name).write_bytes(content)
    assert main(["mesh", str(tmp_path / name), "-o", str(tmp_path / "a.glb")]) == 1
    text = capsys.readouterr().err
    assert all(word in text for word in words)


def test_a_file_is_known_by_its_first_bytes(files: Path) -> None:
    (files / "net.dat").write_bytes((files / "single.npy").read_bytes())
    for name in ("single.npy", "net.dat"):
        assert main(["mesh", str(files / name), "-o", str(files / f"{name}.json")]) == 0
    first, second = ((files / f"{name}.json").read_bytes() for name in ("single.npy", "net.dat"))
    assert first == second
