"""Other libraries read what the service writes: `make test-cad`.

Open CASCADE judges STEP and IGES, VTK the cells of VTU, lib3mf 3MF in its strict mode. The
variables `OCC_PYTHON` and `LIB3MF_PYTHON` are the Pythons of environments that have them.
"""

import json
import os
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from oracles.solids import INVALID, MEASURES, read_solid
from service.bases.affine_combination import to_homogeneous
from service.bases.bernstein import bernstein
from service.bases.triangle_basis import triangle_bernstein
from service.decoders.format import DEFAULT_FILE_LIMITS
from service.decoders.registry import DECODERS
from service.encoders.cad.registry import DEFINITIONS_BY_NAME
from service.encoders.registry import BY_NAME
from service.engine.accuracy import Accuracy
from service.engine.models import to_patches
from service.engine.options import MeshOptions
from service.pipeline.mesh import render
from service.surface.batches import TensorPatches
from service.surface.examples.catalogue import EXAMPLES, find
from service.surface.sizes import SurfaceKind
from tests.encoders.cad.test_step import BOLT, WRITTEN, allow_any, make_group, place, read_surface
from tests.encoders.cad.test_vtu import PATCHES
from tools.cad_files.cells import PLACES

Contents = dict[str, dict[str, Any]]

FILES = Path(__file__).parents[2] / "cad_files"

READERS = {decoder.name: decoder for decoder in DECODERS}

ROUGH = {"ellip": 2e-4, "pipe": 3e-4, "revolve": 2e-4}
"""Solids whose faces Open CASCADE integrates less exactly."""


def run(program: str, python: str, files: list[Path]) -> Contents:
    """The line of a program for each file, by the stem of its name."""
    command = [os.environ[python], "-m", f"tools.cad_files.{program}", *map(str, files)]
    result = subprocess.run(command, capture_output=True, text=True, check=True)
    lines = [line for line in result.stdout.splitlines() if line.startswith('{"file"')]
    contents = {Path(line["file"]).stem: line for line in map(json.loads, lines)}
    assert set(contents) == {file.stem for file in files}
    return contents


def write(folder: Path, name: str, surface: SurfaceKind, fmt: str) -> Path:
    form = DEFINITIONS_BY_NAME[fmt]
    path = folder / f"{name}.{form.suffix}"
    path.write_bytes(bytes(form.encode(surface.lower(), surface.unit, allow_any).content))
    return path


def make_assembly() -> SurfaceKind:
    """A bolt: as it is, turned, mirrored in two ways, scaled; and a sheared box of glass."""
    bolt = read_solid("bolt") | {"name": BOLT}
    bolt["faces"][0]["color"] = [1, 1, 0]
    box = read_solid("box")
    blue = [0.2, 0.4, 0.8]
    mirrored = np.diag([-1.0, 1.0, 1.0, 1.0])
    mirrored[0, 3] = 100.0
    flipped = np.diag([1.0, -1.0, 1.0, 1.0])
    flipped[1, 3] = 50.0
    scaled = np.diag([2.0, 2.0, 2.0, 1.0])
    scaled[0, 3] = 150.0
    sheared = np.array([[1, 0.5, 0, 200], [0, 1, 0, 0], [0, 0, 3, 0], [0, 0, 0, 1.0]])
    return read_surface(
        make_group(
            {"name": "left", "surface": bolt, "color": blue},
            {"name": "turned", "surface": bolt, "color": blue, "matrix": place(50, 0.7)},
            {"name": "mirrored", "surface": bolt, "color": blue, "matrix": mirrored.tolist()},
            {"name": "flipped", "surface": bolt, "color": blue, "matrix": flipped.tolist()},
            {"name": "scaled", "surface": bolt, "matrix": scaled.tolist()},
            {"surface": box, "color": [1, 0, 0, 0.25], "matrix": sheared.tolist()},
        )
        | {"metres_per_unit": 0.0254}
    )


@pytest.fixture(scope="module", params=["step", "iges"])
def files(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Any:
    """The format, and what Open CASCADE reads in it of all solids and examples."""
    folder = tmp_path_factory.mktemp("cad")
    surfaces = {f"solid-{name}": read_surface(read_solid(name)) for name in MEASURES}
    surfaces |= {name: find(name).surface() for name in WRITTEN}
    surfaces["assembly"] = make_assembly()
    written = [write(folder, name, surface, request.param) for name, surface in surfaces.items()]
    return request.param, run("assemblies", "OCC_PYTHON", written)


@pytest.mark.parametrize("name", MEASURES)
def test_solids_are_valid_and_have_their_volumes(files: Any, name: str) -> None:
    fmt, contents = files
    found, expected = contents[f"solid-{name}"], MEASURES[name]
    assert found["is_valid"]
    surface = read_surface(read_solid(name))
    assert found["faces"] == surface.size().faces
    if name == INVALID:  # its shells are open
        return
    accuracy = ROUGH.get(name, 1e-5)
    assert found["area"] == pytest.approx(expected["area"], rel=accuracy)
    volume = found["tree"][0]["volume"] if fmt == "iges" else sum(found["volumes"])
    if fmt == "step":
        assert found["solids"] == 1
        assert volume == pytest.approx(expected["volume"], rel=accuracy)


def test_files_that_come_back_have_the_volumes_of_the_originals(tmp_path: Path) -> None:
    """STEP, as a document, and STEP again: cylinders, cones, spheres and tori become splines.

    Open CASCADE opens `mirrored_scaled` with the inverse of its scale.
    """
    originals = [p for p in sorted(FILES.glob("*.step")) if p.stem != "mirrored_scaled"]
    copies = []
    for path in originals:
        decoded = READERS["step"].decode(path.read_bytes(), None, DEFAULT_FILE_LIMITS)
        copies.append(write(tmp_path, path.stem, read_surface(decoded.tree), "step"))
    before, after = (
        run("open_cascade", "OCC_PYTHON", originals),
        run("open_cascade", "OCC_PYTHON", copies),
    )
    for name, held in before.items():
        assert after[name]["is_valid"]
        assert after[name]["faces"] == held["faces"]
        assert sorted(after[name]["volumes"]) == pytest.approx(sorted(held["volumes"]), rel=1e-9)


@pytest.mark.parametrize("name", WRITTEN)
def test_examples_are_valid(files: Any, name: str) -> None:
    """Faces of untrimmed surfaces, and solids where they are closed."""
    fmt, contents = files
    assert contents[name]["is_valid"]
    surface = EXAMPLES[name].surface()
    form = DEFINITIONS_BY_NAME[fmt]
    report = form.encode(surface.lower(), surface.unit, allow_any).report
    if report.instances == 1:
        assert contents[name]["faces"] == report.faces


def test_instances_have_their_places_names_and_colours(files: Any) -> None:
    fmt, contents = files
    found = contents["assembly"]
    inch = 25.4
    volume = MEASURES["bolt"]["volume"] * inch**3
    if fmt == "iges":
        assert found["faces"] == 66
        return
    (root,) = found["tree"]
    assert root["product"] == "assembly"
    parts = root["parts"]
    assert [part["name"] for part in parts] == [
        *("left", "turned", "mirrored", "flipped", "scaled", "box"),
    ]  # fmt: skip
    assert [part["product"] for part in parts] == [BOLT] * 5 + ["box"]
    blue = [0.2, 0.4, 0.8, 1.0]
    assert [part["color"] for part in parts] == [blue] * 4 + [None, [1.0, 0.0, 0.0, 0.25]]
    assert [part["faces"] for part in parts] == [[[1.0, 1.0, 0.0, 1.0]]] * 5 + [[]]
    sizes = [part["volume"] / volume for part in parts]
    box = 18000 * inch**3 / volume
    assert sizes == pytest.approx([1, 1, 1, 1, 8, box], rel=1e-5)
    x, y = zip(*(part["centre"][:2] for part in parts), strict=True)
    assert np.array(x) / inch == pytest.approx([0, 50, 100, 0, 150, 210], abs=1e-4)
    assert np.array(y) / inch == pytest.approx([0, 0, 0, 50, 0, 10], abs=1e-4)


def test_cells_have_the_points_of_the_patches(tmp_path: Path) -> None:
    written = [write(tmp_path, name, find(name).surface(), "vtu") for name in PATCHES]
    contents = run("cells", "OCC_PYTHON", written)
    uv = np.array(PLACES)
    rst = np.stack([1 - uv.sum(axis=1), *uv.T], axis=1)
    for name in PATCHES:
        model = to_patches(find(name).surface().lower())
        points = np.array(contents[name]["points"])
        first = 0
        for batch in model.batches:
            weights = batch.weights
            net = to_homogeneous(
                batch.points, np.ones(batch.points.shape[:-1]) if weights is None else weights
            )
            if isinstance(batch, TensorPatches):
                basis_u, basis_v = (
                    bernstein(n, t) for n, t in zip(batch.degree, uv.T, strict=True)
                )
                values = np.einsum("ai,aj,pijd->pad", basis_u, basis_v, net)
            else:
                values = np.einsum("ia,pid->pad", triangle_bernstein(batch.degree, rst), net)
            expected = values[..., :3] / values[..., 3:]
            own = points[first : first + batch.count]
            assert np.abs(own - expected).max() <= 1e-13 * model.diagonal
            first += batch.count


def test_meshes_are_read_in_strict_mode_without_a_warning(tmp_path: Path) -> None:
    coarse = MeshOptions(accuracy=Accuracy(relative_tolerance=1e-2))
    surfaces: dict[str, SurfaceKind] = {}
    surfaces |= {name: each.surface() for name, each in EXAMPLES.items()}
    surfaces["assembly"] = make_assembly()
    written = []
    for name, surface in surfaces.items():
        options = MeshOptions(resolution=(4, 4)) if surface.size().curves else coarse
        path = tmp_path / f"{name}.3mf"
        path.write_bytes(render(surface, options, BY_NAME["3mf"]))
        written.append(path)
    contents = run("prints", "LIB3MF_PYTHON", written)
    for content in contents.values():
        assert content["warnings"] == []
        assert content["items"] == 1
        assert all(mesh["is_valid"] for mesh in content["meshes"])
    for name in ("gear", "sphere", "nurbs-goblet", "bspline-ring", "plate-with-holes", "assembly"):
        assert all(mesh["is_manifold"] for mesh in contents[name]["meshes"])
