"""Tubes and ribbons by tolerance in files: groups, formats, cameras, limits, memory."""

import json
from io import BytesIO
from typing import Any

import numpy as np
import pytest
import trimesh

from oracles.distance import Soup
from oracles.sweeps import sample_tube
from service.encoders.format import EncodeOptions
from service.encoders.registry import BY_NAME, FORMATS
from service.engine.accuracy import Accuracy, Camera
from service.engine.options import MeshOptions
from service.errors import InvalidRequest, TooLarge
from service.pipeline.mesh import MeshFile, plan_mesh, render
from service.surface.bezier import BezierSurface
from service.surface.curve import BezierCurve
from service.surface.group import GroupSurface
from service.surface.member import Member
from service.surface.sweeps import RibbonSurface, TubeSurface
from tools.memory import measure_memory

CURVE = BezierCurve(np.array([[0, 0, 0], [1, 2, 0], [3, 2, 1], [4, 0, 1.0]]))
TUBE = TubeSurface(CURVE, np.array([0.3]))
RIBBON = RibbonSurface(CURVE, np.array([0.4, 0.1]))
SADDLE = BezierSurface(np.array([[[0, 0, 0], [0, 1, 1]], [[1, 0, 1], [1, 1, 0.0]]]))
PLACED = np.array([[0, -2, 0, 5.0], [2, 0, 0, 1], [0, 0, 2, -3], [0, 0, 0, 1]])
GROUP = GroupSurface(
    (Member(SADDLE), Member(TUBE, "tube"), Member(TUBE, "large", matrix=PLACED), Member(RIBBON))
)


def make(surface: Any, name: str = "json", encode: Any = None, **accuracy: Any) -> MeshFile:
    options = MeshOptions(accuracy=Accuracy(**accuracy))
    return plan_mesh(surface, options, BY_NAME[name], encode or EncodeOptions()).run()


def get_bound(file: MeshFile) -> float:
    assert file.report is not None
    assert file.report.deviation_bound is not None
    return file.report.deviation_bound


@pytest.mark.parametrize(
    ("name", "is_quantized"),
    [(name, False) for name in ("glb", "stl", "ply", "off", "json")] + [("glb", True)],
)
def test_the_bound_holds_for_the_positions_in_the_file(name: str, is_quantized: bool) -> None:
    file = make(TUBE, name, EncodeOptions(quantize=is_quantized), tolerance=0.02)
    content = bytes(file.content)
    if name == "json":
        document = json.loads(content)
        corners = np.array(document["vertices"])[np.array(document["faces"])]
    else:
        loaded = trimesh.load_scene(BytesIO(content), file_type=name, process=False).to_mesh()
        corners = np.asarray(loaded.triangles, dtype=np.float64)
    bound = get_bound(file)
    assert Soup(corners).farthest(sample_tube(TUBE))[1] <= bound <= 0.02
    assert file.report is not None
    assert len(corners) == file.report.triangles


@pytest.mark.slow
@pytest.mark.parametrize("fmt", FORMATS, ids=lambda fmt: fmt.name)
def test_every_format_stores_a_group_with_tubes(fmt: Any) -> None:
    options = MeshOptions(accuracy=Accuracy(tolerance=0.05))
    file = plan_mesh(GROUP, options, fmt).run()
    assert bytes(file.content) == render(GROUP, options, fmt)
    assert 0 < get_bound(file) <= 0.05


def test_a_copy_that_is_larger_needs_a_finer_mesh() -> None:
    document = json.loads(bytes(make(GROUP, tolerance=0.05, two_sided=True).content))
    large = next(part for part in document["report"]["parts"] if part["name"] == "large")
    assert large["deviation_bound"] <= 0.05
    vertices = np.array(document["vertices"])
    corners = vertices[np.array(document["faces"])]
    points = np.column_stack([sample_tube(TUBE), np.ones(len(sample_tube(TUBE)))]) @ PLACED.T
    assert Soup(corners).farthest(points[:, :3])[1] <= large["deviation_bound"]
    assert document["report"]["mesh_deviation_bound"] <= 0.1


def test_a_camera_that_is_nearer_needs_more_triangles() -> None:
    counts = []
    for distance in (100.0, 20.0, 5.0):
        camera = Camera((2.0, distance, 0.0), 0.8, 1000)
        file = make(TUBE, camera=camera, pixel_tolerance=0.5)
        assert file.report is not None
        counts.append(file.report.triangles)
    assert counts[0] < counts[1] < counts[2]


@pytest.mark.parametrize("surface", [TUBE, RIBBON])
def test_limits_are_those_of_other_meshes(surface: Any) -> None:
    with pytest.raises(TooLarge) as too_large:
        make(surface, tolerance=1e-4, max_triangles=50)
    assert too_large.value.issues[0].pointer == "/max_triangles"
    with pytest.raises(InvalidRequest) as too_small:
        make(surface, tolerance=1e-17)
    assert too_small.value.issues[0].code == "tolerance_too_small"
    with pytest.raises(InvalidRequest) as no_budget:
        make(surface, max_triangles=1)
    assert no_budget.value.issues[0].code == "budget_too_small"


@pytest.mark.parametrize("surface", [TUBE, RIBBON])
def test_a_mesh_takes_no_more_memory_than_predicted_for_its_triangles(surface: Any) -> None:
    file = make(surface, "glb", tolerance=1e-4)
    assert file.report is not None
    options = MeshOptions(accuracy=Accuracy(tolerance=1e-4, max_triangles=file.report.triangles))
    plan = plan_mesh(surface, options, BY_NAME["glb"])
    assert measure_memory(plan.run) <= plan.cost.memory


@pytest.mark.slow
def test_high_degrees_take_little_memory() -> None:
    """Nets of degree 126 over many cells are made in blocks."""
    rng = np.random.default_rng(3)
    points = np.cumsum(rng.normal(size=(65, 3)), axis=0)
    ribbon = RibbonSurface(
        BezierCurve(points, 2.0 ** rng.uniform(-1, 1, 65)),
        np.array([0.5]),
        camera=np.array([0, 0, 300.0]),
    )
    plan = plan_mesh(ribbon, MeshOptions(accuracy=Accuracy(tolerance=1e-2)), BY_NAME["glb"])
    files: list[MeshFile] = []
    memory = measure_memory(lambda: files.append(plan.run()))
    assert files[0].report is not None
    assert memory <= (60 << 20) + 1000 * files[0].report.triangles
