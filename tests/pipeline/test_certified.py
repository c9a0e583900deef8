"""Meshes by tolerance, from the surface to the file: in all formats, in groups, within limits."""

import json
from dataclasses import replace
from io import BytesIO
from typing import Any

import numpy as np
import pytest
import trimesh

from oracles.deviation import measure_surface_to_mesh
from oracles.distance import Soup
from oracles.sheets import build_sheets
from service.encoders.format import EncodeOptions, Format, OoglForm
from service.encoders.registry import BY_NAME, FORMATS
from service.engine.accuracy import Accuracy, Camera
from service.engine.mesh.mesh import Mesh
from service.engine.options import MeshOptions
from service.engine.scenes.placing import place_points
from service.engine.scenes.scene import Scene, scene_parts
from service.errors import SurfaceError, TooLarge
from service.pipeline.adaptive import size_of_mesh
from service.pipeline.limits import Limits
from service.pipeline.mesh import build_planned, keep_storable_channels, plan_mesh, render
from service.pipeline.mesh_plan import build_plan
from service.surface.bezier import BezierSurface, TriangleSurface
from service.surface.brep import BrepSurface
from service.surface.examples.catalogue import EXAMPLES, find
from service.surface.group import GroupSurface
from service.surface.kinds import Surface
from service.surface.member import Member
from service.surface.sizes import SurfaceKind
from tests.strategies import Array

each_format = pytest.mark.parametrize("fmt", FORMATS, ids=lambda fmt: fmt.name)

SHEAR = np.array([[1.0, 0, 0, 4], [2, 1, 0, 0], [0, 0, 3, 0], [0, 0, 0, 1]])
MIRROR = np.array([[-1.0, 0, 0, 0], [0, 1, 0, -5], [0, 0, 1, 0], [0, 0, 0, 1]])
WAVES = np.array([[[i, j, (i * j) % 3] for j in range(4)] for i in range(4)], dtype=float)
DOME = np.array([[0.0, 0, 0], [1, 0, 2], [2, 0, 0], [0, 1, 2], [1, 1, 2], [0, 2, 0]])
SWEEPS = {"trefoil-tube", "ribbon", "hair"}


def build_group(*members: Member) -> GroupSurface:
    return GroupSurface(members)


STRETCHED = build_group(
    Member(BezierSurface(WAVES), "plain"),
    Member(BezierSurface(WAVES), "sheared", matrix=SHEAR),
    Member(TriangleSurface(DOME), "mirrored", matrix=MIRROR),
)


def mesh_options(**accuracy: Any) -> MeshOptions:
    """Options of a mesh with this accuracy."""
    return MeshOptions(accuracy=Accuracy(**accuracy))


def build_mesh(surface: SurfaceKind, options: MeshOptions, fmt: Format) -> Mesh | Scene:
    """The mesh or the scene of the file, before it is encoded."""
    plan = build_plan(surface, options, fmt)
    return build_planned(plan, *keep_storable_channels(surface.lower(), options, fmt))


def list_issues(
    surface: Surface, options: MeshOptions, name: str = "json", **arguments: Any
) -> list[tuple[str, str]]:
    """Codes and pointers of the issues with which the service refuses to render the surface."""
    with pytest.raises(SurfaceError) as refused:
        render(surface, options, BY_NAME[name], **arguments)
    return [(issue.code, issue.pointer) for issue in refused.value.issues]


def read_corners(content: bytes, name: str) -> Array:
    """Corners (T, 3, 3) of all triangles of a file, read by trimesh, copies at their places."""
    loaded = trimesh.load_scene(BytesIO(content), file_type=name, process=False).to_mesh()
    corners: Array = np.asarray(loaded.triangles, dtype=np.float64)
    return corners


@pytest.mark.slow
@pytest.mark.parametrize("example", EXAMPLES)
def test_every_example_is_within_its_tolerance(example: str) -> None:
    surface = find(example).surface()
    response = plan_mesh(surface, mesh_options(relative_tolerance=0.02), BY_NAME["json"]).run()
    document = json.loads(bytes(response.content))
    points = np.array(document["vertices"])
    report = response.report
    assert report is not None
    assert report.deviation_bound is not None
    assert 0 <= report.deviation_bound <= 0.02 * surface.lower().diagonal
    assert len(document["faces"]) == report.triangles > 0
    corners = points[np.array(document["faces"])]
    has_sheets = example not in SWEEPS and not isinstance(surface, BrepSurface | GroupSurface)
    sheets = build_sheets(surface) if has_sheets else []
    if 0 < len(sheets) <= 8:  # sampling the other examples takes seconds
        result = measure_surface_to_mesh(sheets, corners, 400)
        assert result.distance <= report.deviation_bound + result.rounding
    low, high = report.bounds_min, report.bounds_max
    np.testing.assert_array_equal([points.min(axis=0), points.max(axis=0)], [low, high])


@each_format
def test_every_format_stores_all_triangles(fmt: Format) -> None:
    """A second rendering gives the same bytes, not more than the upper bound of the format."""
    surface, options = STRETCHED, mesh_options(relative_tolerance=0.05)
    response = plan_mesh(surface, options, fmt).run()
    assert bytes(response.content) == render(surface, options, fmt)
    assert response.report is not None
    mesh = build_mesh(surface, options, fmt)
    # The numbers of triangles and vertices are those of the mesh, all else is as predicted.
    assert len(bytes(response.content)) <= fmt.byte_bound(
        size_of_mesh(mesh, build_plan(surface, options, fmt).stored), EncodeOptions()
    )
    if fmt.name in {"glb", "stl", "ply", "off", "obj"}:
        assert len(read_corners(bytes(response.content), fmt.name)) == response.report.triangles


def measure_deviation(surface: Surface, corners: Array) -> float:
    """The largest sampled distance from the surface to triangles (T, 3, 3)."""
    return measure_surface_to_mesh(build_sheets(surface), corners, 2000).distance


@pytest.mark.parametrize("name", ["glb", "stl", "ply", "off", "json"])
@pytest.mark.parametrize("offset", [0.0, 3e4])
def test_the_deviation_bound_holds_for_the_positions_in_the_file(name: str, offset: float) -> None:
    """The bound includes rounding to float32, which is coarse far from zero in STL.

    STL has no local origin.
    """
    surface = BezierSurface(WAVES + offset)
    tolerance = 0.02
    response = plan_mesh(surface, mesh_options(tolerance=tolerance), BY_NAME[name]).run()
    assert response.report is not None
    bound = response.report.deviation_bound
    assert bound is not None
    assert bound <= tolerance
    if name == "json":
        document = json.loads(bytes(response.content))
        corners = np.array(document["vertices"])[np.array(document["faces"])]
    else:
        corners = read_corners(bytes(response.content), name)
    result = measure_deviation(surface, corners)
    assert result <= bound
    assert result > bound / 4


@pytest.mark.parametrize("name", ["glb", "stl", "ply", "off"])
def test_the_deviation_bound_holds_for_placed_copies(name: str) -> None:
    response = plan_mesh(STRETCHED, mesh_options(tolerance=0.05), BY_NAME[name]).run()
    assert response.report is not None
    bound = response.report.deviation_bound
    assert bound is not None
    assert bound <= 0.05
    corners = read_corners(bytes(response.content), name)
    deviation = 0.0
    for member in STRETCHED.members:
        (sheet,) = build_sheets(member.surface)
        points = place_points(sheet.at(sheet.samples(1000)) + sheet.origin, member.matrix)
        deviation = max(deviation, float(Soup(corners).distances(points).max()))
    assert bound / 4 < deviation <= bound


def test_equal_members_share_a_mesh_that_is_fine_enough_for_all_of_them() -> None:
    """The bound of a part includes the stretching of its matrix; one member is stretched most."""
    mesh = build_mesh(STRETCHED, mesh_options(tolerance=0.05), BY_NAME["glb"])
    assert isinstance(mesh, Scene)
    assert len(mesh.meshes) == 2
    plain, sheared, mirrored = (part.deviation_bound for part in scene_parts(mesh))
    assert plain is not None
    assert sheared is not None
    assert mirrored is not None
    stretch = np.linalg.norm(SHEAR[:3, :3], 2)
    assert sheared == pytest.approx(plain * stretch, rel=1e-6)
    assert max(sheared, mirrored) == mesh.report.deviation_bound
    alone = build_mesh(
        build_group(STRETCHED.members[0]), mesh_options(tolerance=0.05), BY_NAME["glb"]
    )
    assert isinstance(alone, Scene)
    assert len(alone.meshes[0].triangles) < len(mesh.meshes[0].triangles)


def camera_options(
    position: tuple[float, float, float], pixels: float = 1.0, **accuracy: Any
) -> MeshOptions:
    camera = Camera(position, field_of_view=0.8, height=600)
    return mesh_options(camera=camera, pixel_tolerance=pixels, **accuracy)


def test_parts_far_from_the_camera_have_fewer_triangles() -> None:
    near, far = np.eye(4), np.eye(4)
    far[:3, 3] = 0, 0, -200
    group = build_group(
        Member(BezierSurface(WAVES), matrix=near), Member(BezierSurface(WAVES), matrix=far)
    )
    mesh = build_mesh(group, camera_options((1.5, 1.5, 8.0)), BY_NAME["glb"])
    assert isinstance(mesh, Scene)
    first, second = (len(mesh.meshes[node.model].triangles) for node in mesh.nodes)
    assert second < first / 4
    near_alone = build_mesh(BezierSurface(WAVES), camera_options((1.5, 1.5, 8.0)), BY_NAME["glb"])
    assert isinstance(near_alone, Mesh)
    assert abs(len(near_alone.triangles) - first) <= first / 50


def test_a_tolerance_also_holds_if_a_camera_is_given() -> None:
    mesh = build_mesh(
        BezierSurface(WAVES), camera_options((0, 0, 500.0), tolerance=0.01), BY_NAME["json"]
    )
    assert mesh.report.deviation_bound is not None
    assert mesh.report.deviation_bound <= 0.01


def test_the_deviation_is_bounded_in_both_directions_if_requested() -> None:
    mesh = build_mesh(STRETCHED, mesh_options(tolerance=0.05, two_sided=True), BY_NAME["stl"])
    mesh_bound = mesh.report.mesh_deviation_bound
    assert mesh_bound is not None
    assert mesh.report.deviation_bound is not None
    assert mesh_bound <= 2 * 0.05
    assert mesh.report.deviation_bound <= 0.05


def test_normal_angles_are_within_an_angle_tolerance() -> None:
    sphere = find("sphere").surface()
    coarse, fine = (
        build_mesh(sphere, mesh_options(angle_tolerance=angle), BY_NAME["json"]).report
        for angle in (0.8, 0.2)
    )
    assert coarse.normal_angle is not None
    assert fine.normal_angle is not None
    assert fine.normal_angle <= 0.2 * 1.05  # an angle is a goal that is not certified
    assert fine.triangles > 4 * coarse.triangles
    assert fine.deviation_bound is not None


def test_overlays_are_the_same_with_and_without_faces() -> None:
    options = replace(
        mesh_options(tolerance=0.05), has_faces=False, overlays=("boundary", "control_net")
    )
    mesh = build_mesh(BezierSurface(WAVES), options, BY_NAME["glb"])
    assert isinstance(mesh, Mesh)
    assert not len(mesh.triangles)
    assert mesh.report.deviation_bound is None
    mesh_with_faces = build_mesh(
        BezierSurface(WAVES), replace(options, has_faces=True), BY_NAME["glb"]
    )
    assert isinstance(mesh_with_faces, Mesh)
    for overlay, expected in zip(mesh.overlays, mesh_with_faces.overlays, strict=True):
        np.testing.assert_array_equal(overlay.positions, expected.positions)
    assert len(mesh.overlays[0].segments) == mesh_with_faces.report.boundary_edges


@pytest.mark.parametrize("example", sorted(SWEEPS))
@pytest.mark.parametrize("option", ["tolerance", "relative_tolerance", "angle_tolerance"])
def test_a_sweep_has_a_bound_too(example: str, option: str) -> None:
    mesh = build_mesh(find(example).surface(), mesh_options(**{option: 0.1}), BY_NAME["json"])
    assert mesh.report.deviation_bound is not None
    if option == "angle_tolerance":
        assert mesh.report.normal_angle is not None
        assert mesh.report.normal_angle <= 0.1 * 1.05


@pytest.mark.parametrize(
    ("excluded", "oogl", "pointer"),
    [
        ({"faces": "quads"}, None, "/faces"),
        ({"method": "de_casteljau"}, None, "/method"),
        ({}, "bez", "/oogl"),
        ({}, "cquad", "/oogl"),
        ({}, "mesh", "/oogl"),
    ],
)
def test_options_that_a_tolerance_excludes_are_refused(
    excluded: dict[str, Any], oogl: OoglForm | None, pointer: str
) -> None:
    options = replace(mesh_options(relative_tolerance=0.1), **excluded)
    result = list_issues(find("saddle").surface(), options, "oogl", encode=EncodeOptions(oogl))
    assert result == [("conflicting_options", pointer)]


def test_an_oogl_form_that_a_mesh_by_tolerance_excludes_is_ignored_by_other_formats() -> None:
    surface, options = find("saddle").surface(), mesh_options(relative_tolerance=0.1)
    assert render(surface, options, BY_NAME["obj"], EncodeOptions("cquad"))
    assert b"OFF" in render(surface, options, BY_NAME["oogl"], EncodeOptions("off"))


@pytest.mark.parametrize("example", ["utah-teapot", "tea-service"])
def test_too_many_triangles_are_refused_with_the_pointer_of_the_option(example: str) -> None:
    surface, limits = find(example).surface(), Limits(max_vertices=500)
    options = mesh_options(relative_tolerance=1e-5)
    with pytest.raises(TooLarge) as refused:
        render(surface, options, BY_NAME["glb"], limits=limits)
    (issue,) = refused.value.issues
    assert (issue.code, issue.pointer) == ("too_many_triangles", "/relative_tolerance")
    assert issue.needed.startswith("at most 1000")  # two for each vertex
    result = list_issues(surface, mesh_options(tolerance=1e-4), limits=limits)
    assert result == [("too_many_triangles", "/tolerance")]
    budget = mesh_options(relative_tolerance=1e-5, max_triangles=300)
    assert list_issues(surface, budget) == [("too_many_triangles", "/max_triangles")]


def test_too_many_bytes_are_refused_with_the_pointer_of_the_option() -> None:
    surface, options = find("sphere").surface(), mesh_options(tolerance=0.01)
    result = list_issues(surface, options, limits=Limits(max_bytes=20_000))
    assert result == [("too_many_bytes", "/tolerance")]
    result = list_issues(surface, mesh_options(tolerance=0.01, max_bytes=5_000))
    assert result == [("too_many_bytes", "/max_bytes")]
    content = render(surface, mesh_options(tolerance=0.01, max_bytes=500_000), BY_NAME["json"])
    assert len(content) < 500_000


@pytest.mark.parametrize("name", ["json", "glb", "stl"])
def test_a_tolerance_below_rounding_is_refused_with_the_pointer_of_the_option(name: str) -> None:
    too_small = {"json": 1e-16, "glb": 1e-9, "stl": 1e-9}[name]
    for surface in (find("saddle").surface(), STRETCHED):
        result = list_issues(surface, mesh_options(relative_tolerance=too_small), name)
        assert result == [("tolerance_too_small", "/relative_tolerance")]


@pytest.mark.parametrize("name", ["json", "glb", "stl"])
def test_a_relative_tolerance_of_a_surface_without_size_is_refused(name: str) -> None:
    # 1 % of the size 0 is a tolerance of 0. If it were not refused before the work, only the limit
    # of work would end the search, because no mesh has a deviation of 0 after rounding.
    point = TriangleSurface(np.zeros((3, 3)))
    result = list_issues(
        point, mesh_options(relative_tolerance=0.01), name, limits=Limits(max_multiplications=0)
    )
    assert result == [("tolerance_too_small", "/relative_tolerance")]


@pytest.mark.slow
@pytest.mark.parametrize("size", [0.0, 5e-324, 1e-310, 1e-300])
@pytest.mark.parametrize("name", ["json", "glb", "stl", "oogl"])
@pytest.mark.parametrize("accuracy", [{"tolerance": 0.01}, {"max_triangles": 40}])
def test_a_surface_smaller_than_all_rounding_is_within_a_large_tolerance(
    size: float, name: str, accuracy: dict[str, Any]
) -> None:
    content = render(BezierSurface(WAVES * size), mesh_options(**accuracy), BY_NAME[name])
    if name == "json":
        assert 0 <= json.loads(content)["report"]["deviation_bound"] <= max(20 * size, 1e-12)


def test_the_bound_of_a_copy_far_from_zero_in_stl_includes_rounding_of_its_placed_vertices() -> (
    None
):
    far = np.eye(4)
    far[:3, 3] = 1e5
    group = build_group(Member(BezierSurface(WAVES), matrix=far))
    assert list_issues(group, mesh_options(tolerance=0.001), "stl") == [
        ("tolerance_too_small", "/tolerance")
    ]
    response = plan_mesh(group, mesh_options(tolerance=0.05), BY_NAME["stl"]).run()
    result = measure_deviation(
        BezierSurface(WAVES + 1e5), read_corners(bytes(response.content), "stl")
    )
    assert response.report is not None
    assert response.report.deviation_bound is not None
    assert result <= response.report.deviation_bound <= 0.05
    # In glTF the matrix of the node places the copy, so vertices are rounded near zero.
    assert render(group, mesh_options(tolerance=0.001), BY_NAME["glb"])


def test_without_welding_patches_share_no_vertices() -> None:
    surface, options = find("utah-teapot").surface(), mesh_options(relative_tolerance=0.02)
    welded, separate = (
        build_mesh(surface, replace(options, weld=weld), BY_NAME["json"]).report
        for weld in (True, False)
    )
    assert welded.triangles == separate.triangles
    assert welded.deviation_bound == separate.deviation_bound
    assert separate.vertices > welded.vertices
    assert separate.boundary_edges > welded.boundary_edges


def test_a_camera_far_away_needs_few_triangles() -> None:
    """At the camera the tolerance is almost 0, but the surface is far from the camera."""
    camera = Camera((1e5, 0.0, 0.0), field_of_view=0.8, height=1080)
    mesh = build_mesh(
        BezierSurface(WAVES), mesh_options(camera=camera, pixel_tolerance=1e-3), BY_NAME["glb"]
    )
    assert mesh.report.triangles < 100
    assert mesh.report.deviation_bound is not None
    assert 0.01 < mesh.report.deviation_bound < 0.1
