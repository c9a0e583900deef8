"""Breps through the pipeline: options, budgets, formats, groups, refusals, estimates, memory."""

import json
from math import pi
from typing import Any

import numpy as np
import pytest

from oracles.gltf import read_glb
from oracles.solids import read_solid
from service.encoders.format import EncodeOptions
from service.encoders.registry import BY_NAME, FORMATS
from service.engine.accuracy import Accuracy
from service.engine.bounds.goal import Goal
from service.engine.brep import border_sampling
from service.engine.brep.borders.border import Border
from service.engine.brep.borders.edges import EdgeSamples
from service.engine.brep.borders.settling import LoopFaults, settle_border
from service.engine.brep.mesher import BrepMesher
from service.engine.options import MeshOptions
from service.errors import InvalidRequest, SurfaceError, TooLarge
from service.pipeline.brep_cost import count_coarsest
from service.pipeline.estimate import plan_estimate
from service.pipeline.limits import Limits
from service.pipeline.mesh import MeshFile, plan_mesh, select_encode_options
from service.schemas.request import MeshRequest
from service.schemas.validation import validate_document
from service.surface.sizes import SurfaceKind
from tools.memory import measure_memory

PLATE, BOX, CONE = read_solid("plate"), read_solid("box"), read_solid("cone")
COARSE: dict[str, Any] = {"relative_tolerance": 0.01}


def parse(surface: dict[str, Any], **options: Any) -> MeshRequest:
    return validate_document(MeshRequest, {"surface": surface, **options})


def make(surface: dict[str, Any], fmt: str = "glb", **options: Any) -> MeshFile:
    request = parse(surface, **options)
    encode = select_encode_options(request)
    plan = plan_mesh(request.to_surface(), request.mesh_options(), BY_NAME[fmt], encode)
    return plan.run()


def refusal(surface: dict[str, Any], **options: Any) -> tuple[str, str]:
    """The code and the pointer of the refusal."""
    with pytest.raises(SurfaceError) as caught:
        make(surface, **options)
    return caught.value.issues[0].code, caught.value.issues[0].pointer


def place(surface: dict[str, Any], x: float, scale: float = 1.0, **fields: Any) -> dict[str, Any]:
    """A member of a group, moved along x."""
    matrix = np.diag([scale, abs(scale), abs(scale), 1.0])
    matrix[0, 3] = x
    return {"surface": surface, "matrix": matrix.tolist(), **fields}


@pytest.mark.parametrize("fmt", FORMATS, ids=lambda fmt: fmt.name)
def test_every_format_stores_a_brep(fmt: Any) -> None:
    file = make(BOX, fmt.name)
    assert file.report is not None
    assert file.report.watertight
    assert file.report.brep is not None
    assert file.report.brep.reached
    assert file.report.brep.complete
    assert file.name == "box"


def test_faces_whose_polygons_touch_at_this_tolerance_are_reported_with_a_reason(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def find_fault(*arguments: Any) -> tuple[EdgeSamples, Border, LoopFaults]:
        samples, border, _ = settle_border(*arguments)
        loops, places = np.array([2]), np.zeros((2, 1), np.intp)
        return samples, border, LoopFaults(loops, np.array(["loops_touch"]), loops, loops, places)

    monkeypatch.setattr(border_sampling, "settle_border", find_fault)
    report = make(BOX).report
    assert report is not None
    assert report.deviation_bound is None
    brep = report.brep
    assert brep is not None
    assert [(each.face, each.issue.code) for each in brep.skipped_faces] == [(2, "loops_touch")]
    assert (brep.degenerate_faces, brep.complete, brep.reached) == (0, False, False)


def test_without_options_the_tolerance_is_a_thousandth_of_the_diagonal() -> None:
    plain, named = make(CONE), make(CONE, relative_tolerance=0.001)
    assert bytes(plain.content) == bytes(named.content)
    assert bytes(plain.content) != bytes(make(CONE, relative_tolerance=0.0005).content)


def test_no_mesh_is_coarser_than_a_fiftieth_of_the_diagonal() -> None:
    accuracies: tuple[dict[str, Any], ...] = (
        {"tolerance": 1e6},
        {"relative_tolerance": 1},
        {"relative_tolerance": 0.02},
    )
    files = [make(CONE, **accuracy) for accuracy in accuracies]
    assert len({bytes(file.content) for file in files}) == 1
    assert bytes(files[0].content) != bytes(make(CONE, relative_tolerance=0.01).content)


@pytest.mark.parametrize("name", ["box", "cone", "sphere", "plate", "pipe"])
def test_a_budget_below_the_coarsest_mesh_is_refused_with_its_size(name: str) -> None:
    solid = read_solid(name)
    with pytest.raises(InvalidRequest) as caught:
        make(solid, max_triangles=1)
    (issue,) = caught.value.issues
    assert (issue.code, issue.pointer) == ("budget_too_small", "/max_triangles")
    needed = int(issue.needed.split()[2])
    assert needed <= count_coarsest(parse(solid).to_surface().size())
    if name in ("box", "cone"):
        file = make(solid, max_triangles=needed)
        assert file.report is not None
        assert file.report.triangles == needed


@pytest.mark.parametrize("budget", [{"max_triangles": 400}, {"max_bytes": 18_000}])
def test_a_budget_is_met_and_nearly_used(budget: dict[str, Any]) -> None:
    file = make(PLATE, **budget)
    assert file.report is not None
    used = file.report.triangles if "max_triangles" in budget else len(file.content)
    (allowed,) = budget.values()
    assert 0.8 * allowed <= used <= allowed


@pytest.mark.parametrize(("fmt", "tolerance"), [("glb", 1e-7), ("json", 1e-9), ("json", 1e-300)])
def test_a_tolerance_below_rounding_is_refused_at_once(fmt: str, tolerance: float) -> None:
    assert refusal(CONE, fmt=fmt, tolerance=tolerance) == ("tolerance_too_small", "/tolerance")


def test_a_budget_stops_where_the_gaps_of_a_part_allow_no_better_mesh(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    wide = read_solid("cylinder")
    # A vertex is further from the ends of its edges than any mesh of the budget deviates.
    wide["vertices"][0] = np.add(wide["vertices"][0], [0.3, 0.2, 0.1]).tolist()
    tried: list[float] = []

    def build(self: BrepMesher, goal: Goal, *limits: Any) -> Any:
        tried.append(goal.tolerance)
        return build_mesh(self, goal, *limits)

    build_mesh = BrepMesher.build_mesh
    monkeypatch.setattr(BrepMesher, "build_mesh", build)
    report = make(wide, max_triangles=1000).report
    assert report is not None
    assert report.deviation_bound is not None
    assert report.deviation_bound > 0.3
    assert len(tried) <= 3


def test_a_camera_allows_less_where_it_is_near() -> None:
    def count(distance: float) -> int:
        camera = {"position": [distance, 0, 0], "field_of_view": 0.8, "height": 1000}
        report = make(CONE, camera=camera, pixel_tolerance=1).report
        assert report is not None
        return report.triangles

    assert count(100) > count(1000)


def test_an_angle_is_met_and_measured() -> None:
    report = make(CONE, angle_tolerance=0.3, tolerance=1).report
    assert report is not None
    assert report.normal_angle is not None
    assert report.normal_angle <= 0.33


def test_two_sided_bounds_are_in_the_report() -> None:
    report = make(CONE, two_sided=True, **COARSE).report
    assert report is not None
    brep = report.brep
    assert brep is not None
    assert (report.mesh_deviation_bound is None) == (brep.unbounded_reason is not None)


@pytest.mark.parametrize(
    ("options", "where"),
    [
        ({"resolution": 8}, "/resolution"),
        ({"resolution": 16}, "/resolution"),  # the default, but the request names it
        ({"faces": "quads", "format": "json"}, "/faces"),
        ({"isocurves": 2}, "/isocurves"),
        ({"wires": "tubes"}, "/wires"),
        ({"overlays": ["control_net"]}, "/overlays"),
        ({"method": "de_casteljau"}, "/method"),
        ({"weld": False}, "/weld"),
    ],
)
@pytest.mark.parametrize("is_group", [False, True])
def test_options_that_need_patches_are_refused(
    options: dict[str, Any], where: str, is_group: bool
) -> None:
    sheet = {"control_net": [[[0, 0, 0], [0, 1, 0]], [[1, 0, 0], [1, 1, 1]]]}
    group = {"type": "group", "members": [{"surface": sheet}, {"surface": BOX}]}
    options = {**options}
    fmt = options.pop("format", "glb")
    assert refusal(group if is_group else BOX, fmt=fmt, **options) == ("not_parametric", where)


def test_exact_patches_of_breps_are_refused() -> None:
    assert refusal(BOX, fmt="oogl", oogl="bez") == ("not_parametric", "/oogl")


def test_a_tube_beside_a_brep_is_meshed_with_it() -> None:
    tube = {"type": "tube", "radius": 1, "curve": {"control_points": [[0, 0, 0], [1, 0, 0]]}}
    group = {"type": "group", "members": [{"surface": tube}, {"surface": BOX}]}
    report = make(group).report
    assert report is not None
    assert report.brep is not None
    assert report.brep.reached


def test_edges_are_drawn_through_the_vertices_of_the_mesh() -> None:
    choices: tuple[dict[str, Any], ...] = {}, {"quantize": True}
    for options in choices:
        file = read_glb(bytes(make(CONE, overlays=["boundary"], **options).content))
        ends = {tuple(end) for line in file.corners("boundary").tolist() for end in line}
        corners = {
            tuple(row)
            for primitive in file.document["meshes"][0]["primitives"]
            for row in file.array(primitive["attributes"]["POSITION"]).tolist()
        }
        assert ends
        assert ends <= corners


def test_a_brep_without_faces_is_its_edges() -> None:
    file = make(CONE, faces="none", overlays=["boundary"])
    assert file.report is not None
    assert (file.report.triangles, file.report.deviation_bound) == (0, None)
    document = read_glb(bytes(file.content)).document
    assert [mesh["name"] for mesh in document["meshes"]] == ["boundary"]


def test_curvatures_and_parameters_of_a_cylinder() -> None:
    solid = read_solid("cylinder")
    mesh = json.loads(bytes(make(solid, "json", curvatures=True, uvs=True, **COARSE).content))
    mean = np.array(mesh["attributes"]["mean_curvature"])
    gaussian = np.array(mesh["attributes"]["gaussian_curvature"])
    np.testing.assert_allclose(gaussian, 0, atol=1e-9)
    # The normals point outwards, so the curvature is negative; the two caps are plane.
    radius = -1 / (2 * mean.min())
    is_round = np.isclose(mean, mean.min())
    assert (is_round | np.isclose(mean, 0)).all()
    bounds = np.ptp([mesh["report"]["bounds"]["min"], mesh["report"]["bounds"]["max"]], axis=0)
    assert np.isclose(bounds, 2 * radius, rtol=0.02).sum() >= 2
    assert len(mesh["uvs"]) == len(mesh["normals"])


def test_equal_members_share_a_mesh_and_keep_their_places() -> None:
    members = [place(BOX, 0, name="a"), place(BOX, 99, name="b"), place(BOX, 200, -1.0, name="c")]
    group = {"type": "group", "members": members}
    file = make(group)
    document = read_glb(bytes(file.content)).document
    assert len(document["meshes"]) == 1
    assert [node.get("mesh") for node in document["nodes"]] == [None, 0, 0, 0]
    assert file.report is not None
    assert file.report.triangles == 36
    assert file.report.watertight
    assert file.report.brep is not None
    for fmt in ("stl", "json"):
        flat = make(group, fmt)
        assert flat.report is not None
        assert flat.report.triangles == 36
    mesh = json.loads(bytes(flat.content))
    vertices, faces = np.array(mesh["vertices"]), np.array(mesh["faces"])
    # The volume is positive for all copies, also for the mirrored one.
    for first in (0, 12, 24):
        a, b, c = (vertices[faces[first : first + 12, k]] for k in range(3))
        assert np.vecdot(a, np.cross(b, c)).sum() / 6 > 0


def test_a_group_has_breps_beside_patches_and_never_joins_them() -> None:
    low, high = np.array(BOX["vertices"]).min(axis=0), np.array(BOX["vertices"]).max(axis=0)
    # A sheet that meets the box along two edges.
    (x, *_), y_ends, z_ends = np.stack([high, low], axis=1).tolist()
    net = [[[x, y, z] for z in z_ends] for y in y_ends]
    group = {"type": "group", "members": [{"surface": BOX}, {"surface": {"control_net": net}}]}
    report = make(group).report
    assert report is not None
    assert report.triangles == 14
    assert report.boundary_edges == 4
    assert not report.watertight
    assert report.brep is not None


def test_the_colour_of_a_member_applies_to_faces_without_one() -> None:
    solid = read_solid("box")
    solid["faces"][2]["color"] = [1, 0, 0]
    group = {
        "type": "group",
        "members": [place(solid, 0, color=[0, 0, 1], name="a"), place(solid, 99, name="b")],
    }
    document = read_glb(bytes(make(group).content)).document
    names = [
        [document["materials"][each["material"]]["name"] for each in mesh["primitives"]]
        for mesh in document["meshes"]
    ]
    assert names == [["surface #0000ff", "surface #ff0000"], ["surface", "surface #ff0000"]]
    mesh = json.loads(bytes(make(group, "json").content))
    assert [part.get("color") for part in mesh["parts"]][1:4] == [
        [0, 0, 1, 1], [1, 0, 0, 1], [0, 0, 1, 1],
    ]  # fmt: skip
    colors = np.array(mesh["colors"])
    rows = np.array(mesh["attribute_faces"])
    for part, expected in zip(mesh["parts"], 2 * [0] + [1] + 5 * [0] + [1] + 3 * [0], strict=True):
        part_colors = colors[rows[slice(*part["faces"])]]
        assert (part_colors == [1, 0, 0]).all() == bool(expected)


def test_a_single_brep_has_its_colours_in_formats_of_vertex_colours() -> None:
    solid = read_solid("box")
    assert b"red" not in bytes(make(solid, "ply").content)
    solid["faces"][2]["color"] = [1, 0, 0]
    assert b"property uchar red" in bytes(make(solid, "ply").content)
    assert bytes(make(solid, "off").content).startswith(b"COFF")
    assert bytes(make(solid, "stl").content) == bytes(make(BOX, "stl").content)


def test_names_of_faces_are_groups_of_obj() -> None:
    solid = read_solid("box")
    for face in solid["faces"]:
        face.pop("name", None)
    solid["faces"][1]["name"] = "top side"
    text = bytes(make(solid, "obj").content).decode()
    groups = [line for line in text.splitlines() if line.startswith("g ")]
    assert groups == ["g face_0", "g top_side", *(f"g face_{k}" for k in range(2, 6))]


def test_a_limit_of_work_or_memory_refuses_before_meshing() -> None:
    surface = parse(PLATE).to_surface()
    for limits, code in (
        (Limits(max_memory=1 << 20), "too_much_memory"),
        (Limits(max_multiplications=1000), "too_costly"),
        (Limits(max_mesh_faces=0), "too_costly"),
        (Limits(max_patches=10), "too_many_patches"),
    ):
        with pytest.raises(TooLarge) as caught:
            plan_mesh(surface, MeshOptions(), BY_NAME["glb"], EncodeOptions(), limits)
        assert caught.value.issues[0].code == code


def test_an_estimate_of_a_brep_is_not_certain() -> None:
    for surface in (CONE, {"type": "group", "members": [{"surface": CONE}]}):
        request = parse(surface)
        estimate = json.loads(plan_estimate(request.to_surface(), request.mesh_options()).run())
        assert estimate["accepted"]
        assert not estimate["certain"]
        assert not estimate["exact"]
        for fmt in ("glb", "obj"):
            file = make(surface, fmt)
            assert file.report is not None
            assert len(file.content) <= estimate["bytes"][fmt]
            assert file.report.triangles <= estimate["triangles"]
            assert file.report.vertices <= estimate["vertices"]


def test_an_estimate_lists_the_refusal_of_a_resolution() -> None:
    request = parse(PLATE, resolution=8)
    estimate = json.loads(plan_estimate(request.to_surface(), request.mesh_options()).run())
    assert not estimate["accepted"]
    assert [refused["code"] for refused in estimate["refused"]] == ["not_parametric"]
    assert estimate["refused"][0]["pointer"] == "/resolution"


@pytest.mark.slow
@pytest.mark.parametrize(("name", "fmt"), [("box", "glb"), ("plate", "json"), ("thread", "glb")])
def test_a_mesh_uses_no_more_memory_than_predicted(name: str, fmt: str) -> None:
    surface: SurfaceKind = parse(read_solid(name)).to_surface()
    options = MeshOptions(accuracy=Accuracy(relative_tolerance=1e-3), uvs=True, curvatures=True)
    # With this limit the prediction is not far above that of the mesh.
    triangles = plan_mesh(surface, options, BY_NAME[fmt]).run().report
    assert triangles is not None
    limited = MeshOptions(
        accuracy=Accuracy(relative_tolerance=1e-3, max_triangles=triangles.triangles),
        uvs=True,
        curvatures=True,
        crease_angle=pi / 4,
    )
    work = plan_mesh(surface, limited, BY_NAME[fmt])
    assert measure_memory(work.run) <= work.cost.memory
