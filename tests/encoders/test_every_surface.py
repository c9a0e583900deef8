"""Other programs read our files: of all requests in `tests/forms.py` and of all examples.

`tests/forms.py` has requests with every kind of surface and every group of options.
"""

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
from service.engine.accuracy import Accuracy
from service.engine.mesh.mesh import Mesh
from service.engine.options import Faces, MeshOptions, OverlayName
from service.errors import InvalidRequest, UnsupportedByFormat
from service.pipeline.mesh import keep_storable_channels, render
from service.schemas.request import MeshRequest
from service.schemas.validation import validate_document
from service.surface.batches import TrianglePatches
from service.surface.curve_model import SweepModel
from service.surface.examples.catalogue import EXAMPLES
from service.surface.lowered import GroupModel, PatchModel
from tests.clients.geomview import read_oogl
from tests.clients.gltf_validator import list_issues
from tests.forms import REQUESTS
from tools.building import build
from tools.examples import PARTS, UNTRIMMED

OVERLAYS: tuple[OverlayName, ...] = ("control_net", "boundary")
LINES_ALONE = "isocurves as lines alone"
"""Title of the request for lines without faces."""

each_request = pytest.mark.parametrize("title", REQUESTS)


@cache
def parse_request(title: str) -> MeshRequest:
    return validate_document(MeshRequest, REQUESTS[title])


def encode(title: str, format_name: str) -> bytes:
    """The file of the request with this title in `tests/forms.py`."""
    request = parse_request(title)
    return render(request.to_surface(), request.mesh_options(), BY_NAME[format_name])


def build_mesh(title: str, fmt: Format = BY_NAME["json"]) -> Mesh:
    """The mesh of the request, in float64, with the channels that the format can store."""
    request = parse_request(title)
    model, options = keep_storable_channels(
        request.to_surface().lower(), request.mesh_options(), fmt
    )
    return build(model, options)


@pytest.mark.slow
@each_request
@pytest.mark.parametrize("suffix", ["glb", "gltf"])
def test_the_validator_finds_no_issue(title: str, suffix: str, tmp_path: Path) -> None:
    assert list_issues(encode(title, suffix), tmp_path / f"model.{suffix}") == []


@pytest.mark.slow
@each_request
def test_geomview_reads_all_faces(title: str, tmp_path: Path) -> None:
    """Geomview reads all faces, and each of their corners is a vertex of the mesh."""
    mesh = build_mesh(title)
    geomview_mesh = read_oogl(encode(title, "oogl"), tmp_path)
    # Two triangles of the mesh may be one face of the file.
    assert len(geomview_mesh.faces) >= len(mesh.triangles) / 2
    corners = np.unique([vertex for face in geomview_mesh.faces for vertex in face])
    points = np.concatenate([mesh.positions, *(lines.positions for lines in mesh.overlays)])
    distances, _ = KDTree(points + mesh.origin).query(geomview_mesh.vertices[corners])
    assert distances.max() < 2e-5


@pytest.mark.slow
@each_request
def test_trimesh_reads_every_triangle(title: str) -> None:
    """Corners, winding and colours in trimesh equal those of the mesh that we encode."""
    for name in ("stl", "obj", "ply", "off"):
        check_triangles(title, name)


def check_triangles(title: str, name: str) -> None:
    """Checks that trimesh reads the triangles of the mesh; or that the format refuses lines."""
    fmt = BY_NAME[name]
    if not fmt.has_overlays and "as lines" in title:
        with pytest.raises(UnsupportedByFormat):
            encode(title, name)
        return
    if title == LINES_ALONE:
        # trimesh does not read lines of OBJ.
        assert encode(title, name).count(b"\nl ") > 0
        return
    scene = trimesh.load_scene(BytesIO(encode(title, name)), file_type=name, process=False)
    loaded_meshes: list[trimesh.Trimesh] = list(scene.geometry.values())
    mesh = build_mesh(title, fmt)
    expected = (mesh.positions + mesh.origin)[mesh.triangles]
    corners = np.concatenate([loaded.triangles for loaded in loaded_meshes])
    assert corners.shape == expected.shape
    np.testing.assert_allclose(corners, expected, rtol=0, atol=1e-5 if fmt.is_float32 else 0)
    for loaded in loaded_meshes:
        if isinstance(loaded.visual, TextureVisuals):
            assert mesh.uvs is not None
            np.testing.assert_allclose(
                loaded.visual.uv[loaded.faces], mesh.uvs[mesh.triangles], atol=1e-6
            )
        elif mesh.colors is not None and name in {"obj", "ply"}:
            assert loaded.visual is not None
            # OBJ has no opacity.
            columns = mesh.colors.shape[1] if name == "ply" else 3
            colors = loaded.visual.vertex_colors[loaded.faces][..., :columns].astype(int)
            expected_colors = 255 * mesh.colors[mesh.triangles][..., :columns]
            np.testing.assert_allclose(colors, expected_colors, atol=1)


@pytest.mark.parametrize("title", ["tube", "tube that closes", "isocurves as tubes alone"])
@pytest.mark.parametrize("name", ["stl", "obj", "ply", "off"])
def test_closed_meshes_are_watertight_in_trimesh(title: str, name: str) -> None:
    """The volume that trimesh computes is the volume of the mesh that we encode."""
    scene = trimesh.load_scene(
        BytesIO(encode(title, name)), file_type=name, merge_norm=True, merge_tex=True
    )
    (loaded,) = scene.geometry.values()
    assert isinstance(loaded, trimesh.Trimesh)
    mesh = build_mesh(title)
    assert mesh.report.watertight
    assert loaded.is_watertight
    assert loaded.is_winding_consistent
    corners = mesh.positions[mesh.triangles]
    # The volume is the sum of the tetrahedra between the triangles and the origin.
    assert loaded.volume == pytest.approx(np.linalg.det(corners).sum() / 6, rel=1e-5)
    assert loaded.volume > 0


each_example = pytest.mark.parametrize("example", UNTRIMMED)


@each_example
def test_the_validator_finds_no_issue_in_examples(example: str, tmp_path: Path) -> None:
    options = MeshOptions(resolution=(3, 5), uvs=True, overlays=OVERLAYS)
    content = render(EXAMPLES[example].surface(), options, BY_NAME["glb"])
    assert list_issues(content, tmp_path / "model.glb") == []


@pytest.mark.parametrize("example", PARTS)
def test_the_validator_finds_no_issue_in_parts(example: str, tmp_path: Path) -> None:
    options = MeshOptions(
        accuracy=Accuracy(relative_tolerance=0.01), uvs=True, overlays=("boundary",)
    )
    content = render(EXAMPLES[example].surface(), options, BY_NAME["glb"])
    assert list_issues(content, tmp_path / "model.glb") == []


@pytest.mark.slow
@pytest.mark.parametrize(
    "example", ["utah-teapot", "octahedral-sphere", "tea-service", "trefoil-tube", "swept-wing"]
)
@pytest.mark.parametrize(
    ("form", "faces"), [("mesh", "quads"), ("off", "triangles"), ("bez", "quads")]
)
def test_geomview_reads_examples(
    example: str, form: OoglForm, faces: Faces, tmp_path: Path
) -> None:
    """`form` is the kind of objects in the OOGL file: grids, polygons or Bézier patches."""
    # The form "mesh" stores grids, so patches with a common edge need equal divisions of it.
    resolution = (2, 2) if form == "mesh" else (2, 1)
    options = MeshOptions(resolution=resolution, faces=faces, overlays=OVERLAYS)
    surface, oogl = EXAMPLES[example].surface(), BY_NAME["oogl"]
    model = surface.lower()
    if form == "bez" and isinstance(model, SweepModel):
        with pytest.raises(InvalidRequest, match="not made of Bézier patches"):
            render(surface, options, oogl, EncodeOptions(form))
        return
    models = model.models if isinstance(model, GroupModel) else (model,)
    batch_types = {
        type(batch) for each in models if isinstance(each, PatchModel) for batch in each.batches
    }
    if form == "mesh" and TrianglePatches in batch_types:
        with pytest.raises(UnsupportedByFormat):
            render(surface, options, oogl, EncodeOptions(form))
        return
    assert read_oogl(render(surface, options, oogl, EncodeOptions(form)), tmp_path).faces
