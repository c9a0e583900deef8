"""Every form of a surface, and every example, in files that other programs read correctly."""

from functools import cache
from io import BytesIO
from pathlib import Path

import numpy as np
import pytest
import trimesh
from scipy.spatial import KDTree
from trimesh.visual import TextureVisuals

from service.encoders.format import EncodeOptions, Format, OoglForm
from service.encoders.registry import BY_NAME
from service.engine.build import build
from service.engine.mesh.mesh_value import Mesh
from service.engine.options import Faces, MeshOptions, OverlayName
from service.errors import InvalidRequest, UnsupportedByFormat
from service.pipeline.mesh import keep_storable_channels, render
from service.schemas.request import MeshRequest
from service.schemas.validation import validate_document
from service.surface.batches import TrianglePatches
from service.surface.examples import EXAMPLES
from service.surface.lowered import GroupModel
from service.surface.sweep_model import SweepModel
from tests.clients.geomview import read_oogl
from tests.clients.gltf_validator import list_issues
from tests.forms import REQUESTS

OVERLAYS: tuple[OverlayName, ...] = ("control_net", "boundary")
LINES_ALONE = "isocurves as lines alone"

each_form = pytest.mark.parametrize("form", REQUESTS)


@cache
def request_of(form: str) -> MeshRequest:
    return validate_document(MeshRequest, REQUESTS[form])


def write(form: str, name: str) -> bytes:
    request = request_of(form)
    return render(request.to_surface(), request.mesh_options(), BY_NAME[name])


def build_mesh(form: str, fmt: Format = BY_NAME["json"]) -> Mesh:
    """The mesh of the file, in float64 and as one mesh."""
    request = request_of(form)
    model, options = keep_storable_channels(
        request.to_surface().lower(), request.mesh_options(), fmt
    )
    return build(model, options)


@each_form
@pytest.mark.parametrize("suffix", ["glb", "gltf"])
def test_the_validator_finds_no_issue(form: str, suffix: str, tmp_path: Path) -> None:
    assert list_issues(write(form, suffix), tmp_path / f"model.{suffix}") == []


@each_form
def test_geomview_reads_all_faces(form: str, tmp_path: Path) -> None:
    """Geomview reads all faces, with every corner in its place."""
    mesh = build_mesh(form)
    read = read_oogl(write(form, "oogl"), tmp_path)
    assert len(read.faces) >= len(mesh.triangles) / 2
    used = np.unique([row for face in read.faces for row in face])
    points = np.concatenate([mesh.positions, *(lines.positions for lines in mesh.overlays)])
    truth = KDTree(points + mesh.origin)
    furthest, _ = truth.query(read.vertices[used])
    assert furthest.max() < 2e-5


@each_form
def test_trimesh_reads_every_triangle(form: str) -> None:
    """trimesh reads the corners, the winding and the colours of the JSON mesh."""
    for name in ("stl", "obj", "ply", "off"):
        check_triangles(form, name)


def check_triangles(form: str, name: str) -> None:
    fmt = BY_NAME[name]
    if not fmt.overlays and "as lines" in form:
        with pytest.raises(UnsupportedByFormat):
            write(form, name)
        return
    if form == LINES_ALONE:
        assert write(form, name).count(b"\nl ") > 0
        return
    scene = trimesh.load_scene(BytesIO(write(form, name)), file_type=name, process=False)
    loaded: list[trimesh.Trimesh] = list(scene.geometry.values())
    mesh = build_mesh(form, fmt)
    corners = (mesh.positions + mesh.origin)[mesh.triangles]
    result = np.concatenate([item.triangles for item in loaded])
    assert result.shape == corners.shape
    np.testing.assert_allclose(result, corners, rtol=0, atol=1e-5 if fmt.single else 0)
    for item in loaded:
        if isinstance(item.visual, TextureVisuals):
            assert mesh.uvs is not None
            np.testing.assert_allclose(
                item.visual.uv[item.faces], mesh.uvs[mesh.triangles], atol=1e-6
            )
        elif mesh.colors is not None and name in {"obj", "ply"}:
            assert item.visual is not None
            width = mesh.colors.shape[1] if name == "ply" else 3
            colors = item.visual.vertex_colors[item.faces][..., :width].astype(int)
            colored = 255 * mesh.colors[mesh.triangles][..., :width]
            np.testing.assert_allclose(colors, colored, atol=1)


@pytest.mark.parametrize("form", ["tube", "tube that closes", "isocurves as tubes alone"])
@pytest.mark.parametrize("name", ["stl", "obj", "ply", "off"])
def test_trimesh_finds_closed_meshes_closed(form: str, name: str) -> None:
    """Closed meshes are watertight in trimesh, with the right volume."""
    scene = trimesh.load_scene(
        BytesIO(write(form, name)), file_type=name, merge_norm=True, merge_tex=True
    )
    (loaded,) = scene.geometry.values()
    assert isinstance(loaded, trimesh.Trimesh)
    mesh = build_mesh(form)
    assert mesh.report.watertight
    assert loaded.is_watertight
    assert loaded.is_winding_consistent
    corners = mesh.positions[mesh.triangles]
    assert loaded.volume == pytest.approx(np.linalg.det(corners).sum() / 6, rel=1e-5)
    assert loaded.volume > 0


each_example = pytest.mark.parametrize("example", EXAMPLES)


@each_example
def test_the_validator_finds_no_issue_in_examples(example: str, tmp_path: Path) -> None:
    options = MeshOptions(resolution=(3, 5), uvs=True, overlays=OVERLAYS)
    content = render(EXAMPLES[example].surface(), options, BY_NAME["glb"])
    assert list_issues(content, tmp_path / "model.glb") == []


@pytest.mark.parametrize(
    "example", ["utah-teapot", "octahedral-sphere", "tea-service", "trefoil-tube", "swept-wing"]
)
@pytest.mark.parametrize(
    ("form", "faces"), [("mesh", "quads"), ("off", "triangles"), ("bez", "quads")]
)
def test_geomview_reads_examples(
    example: str, form: OoglForm, faces: Faces, tmp_path: Path
) -> None:
    # A form of grids cannot store neighbours with different divisions of their common edge.
    resolution = (2, 2) if form == "mesh" else (2, 1)
    options = MeshOptions(resolution=resolution, faces=faces, overlays=OVERLAYS)
    surface, oogl = EXAMPLES[example].surface(), BY_NAME["oogl"]
    model = surface.lower()
    if form == "bez" and isinstance(model, SweepModel):
        with pytest.raises(InvalidRequest, match="not made of Bézier patches"):
            render(surface, options, oogl, EncodeOptions(form))
        return
    models = model.models if isinstance(model, GroupModel) else (model,)
    kinds = {type(b) for m in models if not isinstance(m, SweepModel) for b in m.batches}
    if form == "mesh" and TrianglePatches in kinds:
        with pytest.raises(UnsupportedByFormat):
            render(surface, options, oogl, EncodeOptions(form))
        return
    assert read_oogl(render(surface, options, oogl, EncodeOptions(form)), tmp_path).faces
